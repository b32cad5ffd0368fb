//! Helpers for several groups of tests: heavy, slow, raw and forged requests, requests that provoke a problem, videos.

pub mod blocked;
pub mod forged;
pub mod heavy;
pub mod provoke;
pub mod raw;
pub mod slow_line;
pub mod video_files;
