//! Frames over a WebSocket.

pub mod stream;
pub mod stream_memory;
