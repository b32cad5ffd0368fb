//! Files to frames: what is taken, what is refused, and what it may cost.

mod formats;
mod hostile;
mod memory;
mod upstream;
