//! What several subjects use: requests that are heavy, slow, raw, forged, or that provoke a problem, and videos.

pub mod blocked;
pub mod forged;
pub mod heavy;
pub mod provoke;
pub mod raw;
pub mod slow_line;
pub mod video_files;
