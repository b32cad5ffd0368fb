//! What each client may use: sessions, requests and frames in a time, and work at once.
//!
//! In: who makes a request. Out: a permit for it, or the problem `quota-exceeded` with the time to wait.
//!
//! What can go wrong: a client changes its address to count as new. IPv6 addresses count by their network, and the
//! table of clients is bounded.

pub mod account;
pub mod client;
pub mod clients;
pub mod holdings;
