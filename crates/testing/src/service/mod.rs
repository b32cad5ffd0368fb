//! Services under test.

pub mod application;
pub mod lossy;
pub mod program;
pub mod replica;
pub mod stream_client;
