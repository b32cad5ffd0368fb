//! The settings of the service, with their defaults and ranges.
//!
//! In: flags and environment variables, or a [`Config`](service::Config) made by code. Out: a checked one.
//!
//! What can go wrong: settings contradict each other, or allow more memory than the machine has. [`settings`] refuses
//! the first, [`memory_bound`] computes the second.

pub mod access;
pub mod base_path;
pub mod flag_values;
pub mod limits;
pub mod memory_bound;
pub mod service;
pub mod settings;
pub mod store;
#[cfg(feature = "tls")]
pub mod tls;
