//! What the acts of a service without a store do, and what they refuse. The service's work runs on the thread of the
//! test, so that waiting takes no time where the test pauses the clock.

mod away;
#[path = "../common/mod.rs"]
mod common;
mod frames;
mod opening;
mod renewal;
mod turns;
mod world;
