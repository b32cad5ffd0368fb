//! Whole videos: decoded, tracked, propagated between key frames, and against what was annotated.

pub mod decoder;
pub mod footage;
pub mod propagation;
pub mod track_video;
pub mod videos;
