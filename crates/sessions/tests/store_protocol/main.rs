//! Tests of stores of sessions, and of two replicas over a store that misbehaves.
//!
//! [`suite`] holds for every store. [`schedule`] drives the real service, with trackers and workers, over a store that
//! delays, drops, repeats and forgets.

mod cached;
#[path = "../common/mod.rs"]
mod common;
mod expiry;
mod flush;
mod folder;
mod formats;
mod hostile;
mod keys;
mod memory;
mod pictures;
mod records;
mod redis;
mod schedule;
mod suite;
mod world;
