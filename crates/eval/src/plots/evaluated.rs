//! What is plotted.

use crate::run::SequenceRuns;

/// The runs of one variant on all sequences.
#[derive(Debug, Clone)]
pub struct Evaluated {
    /// What the legend calls it.
    pub label: String,
    /// Its runs; all variants have the same sequences in the same order.
    pub runs: Vec<SequenceRuns>,
}
