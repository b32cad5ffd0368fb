//! Who may use the service.
//!
//! In: request heads. Out: a [`Caller`](caller::Caller) in the extensions of a request, or a problem: 401 without a
//! valid API key, 403 for a page of another origin, 421 for another host.
//!
//! An API key opens sessions, and a session belongs to the name of the key that opened it: to others it is 404. Several
//! keys may have one name, so that a key can be replaced. For a web page, which cannot keep a key, whoever has one can
//! make a session token ([`token`]): it is good for one session and a limited time, and nothing about it is stored.
//!
//! What can go wrong: a key is guessed by timing (digests are compared in constant time), or leaks by the log (it is
//! never logged, and [`Secret`](bagtrack_config::Secret) does not show itself); a file of keys is broken when it is read
//! again (the keys before stay); the service is open to a network by accident (it does not start then; see [`access`]);
//! a web page elsewhere uses the browser of somebody inside (its origin is checked, and its [host](hosts)).

pub mod access;
pub mod caller;
pub mod hosts;
pub mod keys;
pub mod token;
