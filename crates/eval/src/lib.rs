//! Annotated sequences, error measures, runs over several seeds, and what they show.
//!
//! In: a [`Sequence`], which is a folder in the OTB layout, in the order that [`Playback`] says. [`run`] tracks through
//! it once for each seed.
//!
//! Out: a [`Report`] with the figures as a table or as JSON, among them how good the [score](calibration) is. A
//! [`Comparison`] has a row for each [`Variant`]; the [`ablation`] is a fixed list of variants.
//! [`results`] writes the boxes for other toolkits, and the figures of each frame.
//!
//! What can go wrong: with frames and annotations that do not belong together the figures would mean nothing. So a
//! sequence with a missing frame, a missing line or an unreadable frame is refused as a whole, with a message that
//! names the folder.

pub mod ablation;
pub mod calibration;
mod comparison;
mod figures;
mod isotonic;
pub mod measures;
mod playback;
mod report;
pub mod results;
mod run;
mod sequence;
mod table;
mod variant;

pub use comparison::Comparison;
pub use figures::{Figures, Named, ScoreFigures, SeedMean};
pub use isotonic::Isotonic;
pub use playback::Playback;
pub use report::Report;
pub use run::{EvalError, HIT_OVERLAP, Outcome, ScoredFrame, SeedRun, SequenceRuns, run};
pub use sequence::Sequence;
pub use variant::Variant;
