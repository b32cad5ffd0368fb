//! bagtrack follows one object through a sequence of frames.
//!
//! Data goes one way: [`ingest`] turns uploaded bytes into a working image, [`sessions`] keeps a tracker
//! for each client, [`tracker`] is the paper (*Bags of Affine Subspaces for Robust Object Tracking*).

pub mod eval;
pub mod http;
pub mod ingest;
pub mod sample;
pub mod sessions;
pub mod tracker;
