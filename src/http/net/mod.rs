//! The network: connections, and how slowly a client may read and write.
//!
//! In: sockets. Out: the bytes of requests, for whom serves them.
//!
//! What can go wrong: a client sends its head or reads its answer slowly, opens many connections, or keeps idle ones.
//! [`least_rate`] and the time limits for handshakes and heads bound the first, [`connections`] the others.

pub mod activity;
#[cfg(feature = "tls")]
pub mod certificate;
pub mod connection_hold;
pub mod connection_io;
pub mod connections;
pub mod handshake;
pub mod least_rate;
