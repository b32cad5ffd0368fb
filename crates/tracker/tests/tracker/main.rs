//! The tracker through its public surface.

mod allocation;
mod color;
mod degenerate;
mod evaluation;
mod flow;
mod memory;
mod params;
mod rect;
mod robust;
mod seen;
mod snapshot;
mod textbook_step;
