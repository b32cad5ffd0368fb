//! One scored frame as the score is judged by it: what was claimed, and what was true.

/// The smallest overlap (intersection over union) of a hit.
pub const HIT_OVERLAP: f64 = 0.5;

/// The outcome of one scored frame of one run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// The chance of a hit that was claimed, 0 to 1.
    pub score: f64,
    /// Whether it was a hit.
    pub hit: bool,
}
