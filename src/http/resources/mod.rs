//! The resources of the interface, a file each: extract the request, do one act, respond.
//!
//! In: requests that passed the middleware. Out: responses or problems, by the types in `extract`, `respond` and
//! `problems`.

pub mod bag_picture;
pub mod correction;
mod frame_lines;
pub mod frames;
pub mod health;
pub mod metrics;
pub mod open;
pub mod routes;
pub mod session;
pub mod snapshot;
pub mod token;
pub mod track;
mod track_file;
mod track_video;
pub mod version;
pub mod video_frames;
