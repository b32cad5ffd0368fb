//! The service in this process, without sockets, and the inputs that the fuzz targets share.

mod pictures;
mod service;
mod shelf;

pub use pictures::{jpeg, pattern, png, webp, HEIGHT, WIDTH};
pub use service::{content_of, snapshot_of, Answer, Service};
pub use shelf::{Shelf, Stored, MAX_RECENT};

/// The box of the target in the pictures, as text for a query.
pub const BOX: &str = "16,12,16,12";
/// The parameters of the sessions in the seeds: small, so that a mutation is likely to change each part of a state.
pub const SETTINGS: &str =
    "seed=7&parameters=%7B%22particles%22:4,%22patch_width%22:4,%22patch_height%22:4,\
    %22basis_dim%22:1,%22history%22:1,%22bag_size%22:1%7D";
