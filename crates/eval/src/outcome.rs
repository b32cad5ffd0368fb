//! One scored frame: the score that the tracker gave, and whether the box was a hit.

/// The smallest overlap (intersection over union) of a hit.
pub const HIT_OVERLAP: f64 = 0.5;

/// The outcome of one scored frame of one run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// The claimed probability of a hit, 0 to 1: the tracker's score, or a value fitted to it.
    pub score: f64,
    /// Whether it was a hit.
    pub hit: bool,
}
