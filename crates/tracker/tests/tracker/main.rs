//! The tracker through its public surface.

mod allocation;
mod color;
mod degenerate;
mod diagnostics;
mod evaluation;
mod expert;
mod flow;
mod lost;
mod memory;
mod params;
mod rect;
mod robust;
mod snapshot;
mod textbook_step;
