//! Annotated sequences, error measures, runs over several seeds, and what they show.
//!
//! In: a [`Sequence`], which is a folder in the OTB layout, in the order that [`Playback`] says. [`run`] tracks through
//! it once for each seed.
//!
//! Out: a [`Report`] with the figures as a table or as JSON, among them how good the [score](calibration) is. A
//! [`Comparison`] has a row for each [`Variant`]; the [`ablation`] is a fixed list of variants.
//! [`ScoreReport`] fits the score's coefficients anew. [`results`] writes the boxes for other toolkits.
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
mod outcome;
mod playback;
mod report;
pub mod results;
mod run;
mod score_fit;
mod score_report;
mod score_table;
mod sequence;
mod sweep;
mod table;
mod variant;

pub use comparison::Comparison;
pub use figures::{Figures, Named, ScoreFigures, SeedMean};
pub use isotonic::Isotonic;
pub use outcome::{HIT_OVERLAP, Outcome};
pub use playback::Playback;
pub use report::Report;
pub use run::{EvalError, ScoredFrame, SeedRun, SequenceRuns, run};
pub use score_fit::{Sample, fit as fit_score};
pub use score_report::{ScoreFitError, ScoreReport};
pub use sequence::Sequence;
pub use sweep::{SweepError, parse_sweep};
pub use variant::Variant;
