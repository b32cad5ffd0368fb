//! The service over a real socket, with a real client.

mod access;
mod application;
mod bag;
mod binary;
mod bombs;
mod capacity;
mod connections;
mod expiry;
#[cfg(feature = "otel")]
mod export;
mod flow;
mod footage;
mod forms;
mod heavy;
mod hostile_connections;
mod idempotency;
mod log;
mod metrics;
mod openapi;
mod origins;
mod page;
mod pictures;
mod problems;
mod process;
mod provoke;
mod quotas;
mod raw;
mod replay;
mod slow_line;
mod snapshots;
mod stream;
mod stream_client;
mod uploads;
