//! The settings of the service, with their defaults and ranges.
//!
//! In: flags and environment variables, or a [`Config`] made by code. Out: a checked [`Config`].
//!
//! What can go wrong: settings contradict each other, or allow more memory than the machine has. [`Config::validate`]
//! refuses the first, [`MemoryBound`] computes the second.

#![warn(clippy::disallowed_methods)]

mod access;
mod base_path;
mod flag_values;
mod limits;
mod memory_bound;
mod service;
mod settings;
mod store;

pub use access::AccessConfig;
#[cfg(feature = "jwt")]
pub use access::JwtConfig;
pub use base_path::{BasePath, BasePathError};
pub use flag_values::{parse_duration, parse_listen};
pub use limits::{LimitsConfig, OFF};
pub use memory_bound::{MAX_BUFFER_BYTES, MemoryBound, PROBE_CONNECTIONS};
#[cfg(feature = "tls")]
pub use service::TlsConfig;
pub use service::{BODY_BYTES_PER_SECOND, Config};
pub use settings::{ConfigError, Secret};
pub use store::StoreConfig;
