//! Access: keys and tokens, origins and hosts, HTTPS.

pub mod access;
#[cfg(feature = "tls")]
pub mod https;
#[cfg(feature = "jwt")]
pub mod identity_provider;
pub mod origins;
