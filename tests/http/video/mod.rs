//! Whole videos: decoding, tracking, propagation between key frames, and comparison with annotated boxes.

pub mod decoder;
pub mod footage;
pub mod propagation;
pub mod track_video;
pub mod videos;
