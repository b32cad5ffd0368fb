//! The service over a real socket, with a real client.

mod access;
mod application;
mod binary;
mod capacity;
mod connections;
mod expiry;
#[cfg(feature = "otel")]
mod export;
mod flow;
mod footage;
mod forms;
mod idempotency;
mod log;
mod metrics;
mod openapi;
mod origins;
mod pictures;
mod problems;
mod process;
mod provoke;
mod raw;
mod replay;
mod snapshots;
