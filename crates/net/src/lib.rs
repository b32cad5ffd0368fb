//! The connections of a service: how many there are, what each is doing, and how slowly its client may read and write.
//!
//! In: sockets. Out: streams of bytes for HTTP and for WebSockets ([`Fragments`]), and the address of each request's
//! client ([`client_address()`]).
//!
//! What can go wrong: a client sends its head or reads its answer slowly, opens many connections, keeps idle ones, or
//! begins large messages on many streams. [`LeastRate`] and the time limits for handshakes and heads bound the first,
//! [`Connections`] the next two, and the memory of messages is charged as they arrive.

#![warn(clippy::disallowed_methods)]

mod activity;
#[cfg(feature = "tls")]
mod certificate;
mod client_address;
mod connection_io;
mod connections;
mod fragments;
mod handshake;
mod least_rate;

pub use activity::Activity;
#[cfg(feature = "tls")]
pub use certificate::{Certificate, CertificateError};
pub use client_address::{
    Peer, client_address, customer_address, is_forwarded, is_trusted, wider_networks,
};
pub use connection_io::{ClientLimits, ConnectionIo};
pub use connections::{ConnectionHold, ConnectionPermit, Connections, NoRoom};
pub use fragments::{Fragments, MessageRate, MessageTooSlow, Rates};
#[cfg(feature = "tls")]
pub use handshake::MAX_UNSENT_BYTES;
pub use handshake::{Begun, ByteStream, Security, Transport};
pub use least_rate::LeastRate;
