//! The tracker for browsers and Node.js: [`bagtrack_tracker`] behind an interface of numbers, bytes and names.
//!
//! In: frames as RGBA or as planes, boxes in pixels of the frames, parameters by name. Out: estimates, snapshots, what
//! a step has seen. What can go wrong is thrown as a JavaScript `Error` with the tracker's own words, and leaves the
//! tracker as it was. The files in `clients/js/wasm` are built from here by `cargo run --package bagtrack-wasm-build`;
//! the modules in `clients/js` make of them what people use.

mod estimate;
mod frame;
mod parameters;
mod tracker;

pub use estimate::{WasmEstimate, WasmSeen};
pub use frame::WasmFrame;
pub use parameters::WasmParameters;
pub use tracker::{WasmEntry, WasmTracker};
