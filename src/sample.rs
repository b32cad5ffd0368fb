//! A synthetic clip with exact ground truth.
