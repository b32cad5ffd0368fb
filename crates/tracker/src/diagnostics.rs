//! What a step's answer was chosen from, for people who want to look at it. A step that is not asked for it copies
//! nothing.

use crate::candidates::Candidates;
use crate::image::rect::Rect;
use crate::state::State;
use crate::weights;

/// What one step's answer was chosen from.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Diagnostics {
    /// The particles that the answer was chosen from, in the order in which they were drawn: the box of each, in pixels
    /// of the uploaded frame, and its weight. Weights are at least 0 and sum to 1.
    pub particles: Vec<(Rect, f64)>,
    /// For each entry of the bag, oldest first, its share of the likelihood of the best particle (equation 11): at
    /// least 0, with the sum 1.
    pub votes: Vec<f64>,
}

impl Diagnostics {
    /// The diagnostics of a step with these candidates.
    pub(crate) fn of(state: &State, candidates: &Candidates) -> Self {
        let boxes = candidates.particles.iter();
        let boxes = boxes.map(|particle| state.target_of(particle));
        let best = weights::arg_max(&candidates.weights);
        let sigma = state.params.sigma;
        let distances = candidates.distances_of(best);
        let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
        let likelihood = |distance: &f64| ((least - distance) / sigma).exp();
        let mut votes: Vec<f64> = distances.iter().map(likelihood).collect();
        let sum: f64 = votes.iter().sum();
        votes.iter_mut().for_each(|vote| *vote /= sum);
        let particles = boxes.zip(candidates.weights.iter().copied()).collect();
        Self { particles, votes }
    }
}
