//! A deterministic simulation: three replicas of the real service, the real store over a simulated Redis, and the real
//! Rust client, in one thread on a simulated clock. All random choices are drawn from one seed.
//!
//! | who | what is real | what is simulated |
//! |---|---|---|
//! | callers (`caller`) | the client `bagtrack-client`, its rules (docs/PROTOCOL.md) | what they want, and their patience |
//! | streams | HTTP/1.1 and WebSockets, both ends | the caller's rules: those of a camera |
//! | the network (`network`) | requests and answers as HTTP has them | lines that lose, delay, double and break |
//! | replicas (`replica`) | routes, acts, store, scheduler, tracker | sockets, threads, processor time |
//! | the store (`redis`) | its Lua scripts | the server: keys, times to live, and whether it is there |
//! | the nemesis (`nemesis`) | | kills, drains, restarts, clocks that jump |
//!
//! In each run `journal`, `caller` and `checks` check what the service promises: every answer is that of the tracker
//! alone (`replay`), no frame number has two different answers, no frame is answered before the store has it, every
//! session lives until its caller ends it or it expires, and no replica holds anything at the end.
//!
//! A run of a seed can be repeated exactly: one thread runs all tasks in order, the clock is tokio's paused clock, and
//! all random numbers are drawn from the seed, those of the service by `bagtrack_sessions::random`. Work takes
//! simulated time only: what the scheduler does with measured times is left to its own tests.

mod caller;
mod chance;
mod checks;
mod cluster;
mod faults;
mod journal;
mod life;
mod line;
mod nemesis;
mod network;
#[cfg(feature = "planted-faults")]
mod planted;
mod redis;
mod replay;
mod replica;
mod scenes;
mod streamer;
mod trace;
mod world;

#[cfg(feature = "planted-faults")]
pub use planted::finds;
pub use world::{Outcome, run};
