//! Services under test.

pub mod application;
pub mod lossy;
pub mod pictures;
pub mod program;
pub mod replica;
pub mod server;
pub mod stream_client;
