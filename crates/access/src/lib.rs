//! Who may use the service.
//!
//! In: the key or token of a request, and the host that it names. Out: the [`Owner`](bagtrack_sessions::Owner) that the
//! key, the [`SessionToken`] or the token of an identity provider speaks for; and whether the request may name its host
//! ([`AllowedHosts`]).
//!
//! An API key opens sessions, and a session belongs to the name of the key that opened it: to others it is 404. Several
//! keys may have one name, so that a key can be replaced. For a web page, which cannot keep a key, the owner of a key
//! can make a session token, which is good for one session and a limited time. The service stores nothing about it.
//!
//! What can go wrong: a key is guessed by timing (digests are compared in constant time), or leaks by the log (it is
//! never logged, and [`Secret`](bagtrack_config::Secret) does not show itself); a file of keys is broken when it is
//! read again (the former keys stay); the service is open to a network by accident (it does not start then: see
//! [`AccessError`]); a web page elsewhere uses the browser of somebody inside (its host is checked here, and its origin
//! by the service).

#![warn(clippy::disallowed_methods)]

mod access;
mod hosts;
#[cfg(feature = "jwt")]
mod jwt;
mod keys;
mod token;

pub use access::{Access, AccessError, Credential, NotIdentified};
pub use hosts::AllowedHosts;
#[cfg(feature = "jwt")]
pub use jwt::{Identity, JwtError, KeySetError, KeySource, SourceError, TokenError, TokenVerifier};
pub use keys::{ApiKeys, KeysError};
pub use token::{PREFIX as TOKEN_PREFIX, SessionToken, TokenKeys};
