//! The program as its operators see it: flags, logs, metrics, containers, its end.

pub mod base_path;
pub mod binary;
pub mod containers;
pub mod counted;
#[cfg(feature = "otel")]
pub mod export;
pub mod log;
pub mod metrics;
pub mod process;
