//! The service in this process, without sockets, and the pictures that the targets send.

mod pictures;
mod service;

pub use pictures::{jpeg, pattern, png, webp, HEIGHT, WIDTH};
pub use service::{content_of, snapshot_of, Answer, Service};

/// The box of the target in the pictures.
pub const BOX: &str = "16,12,16,12";
