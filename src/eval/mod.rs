//! Annotated sequences, error measures, runs over several seeds, and what they show.
//!
//! A [`Sequence`] is a folder in the OTB layout, played [one way or another](Playback); [`run`] tracks through it once for each seed;
//! [`Report`] holds the figures as a table or as JSON, and says how good the [score](calibration) is.
//! [`ScoreReport`] fits the score's coefficients anew. [`Comparison`] sets [variants](Variant) side by side, of which the [`ablation`] is a fixed list, and [`plots`] draws
//! them. What could go wrong: frames and annotations that do not belong together would give figures that mean nothing;
//! so a sequence with a missing frame, a missing line or an unreadable frame is refused as a whole, by a message that
//! names the folder.

pub mod ablation;
pub mod calibration;
mod comparison;
mod figures;
pub mod frames;
mod isotonic;
pub mod measures;
mod playback;
pub mod plots;
mod report;
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
pub use playback::Playback;
pub use report::Report;
pub use run::{EvalError, ScoredFrame, SeedRun, SequenceRuns, run};
pub use score_fit::{Sample, fit as fit_score};
pub use score_report::{ScoreFitError, ScoreReport};
pub use sequence::{Sequence, SequenceError, parse_boxes};
pub use sweep::{SweepError, parse_sweep};
pub use variant::{AssignError, Assignment, Variant, assign, parse_assignment};
