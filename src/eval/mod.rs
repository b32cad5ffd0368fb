//! Annotated sequences, error measures, and runs over several seeds.
//!
//! A [`Sequence`] is a folder in the OTB layout; [`run`] tracks through it once for each seed;
//! [`Report`] holds the figures as a table or as JSON. What could go wrong: frames and annotations that do not
//! belong together would give figures that mean nothing; so a sequence with a missing frame, a missing line or an
//! unreadable frame is refused as a whole, by a message that names the folder.

pub mod frames;
pub mod measures;
mod report;
mod run;
mod sequence;

pub use report::{Figures, Named, Report};
pub use run::{EvalError, SeedRun, run};
pub use sequence::{Sequence, SequenceError, parse_boxes};
