//! Who may call, from where, and over which line.

pub mod access;
#[cfg(feature = "tls")]
pub mod https;
#[cfg(feature = "jwt")]
pub mod identity_provider;
pub mod origins;
