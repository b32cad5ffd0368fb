//! Where the box of a lost target goes.
//!
//! Whether a target is lost is decided by the update gate. A target in full view that has turned away may count as
//! lost, yet its place still resembles it more than any place nearby. So the box follows the particles where these
//! speak for it, else the target's colours, else the camera's motion.

use crate::image::frame::Frame;
use crate::motion::particles::Particle;
use crate::motion::search::{SearchContext, prior_width};
use crate::state::State;
use crate::workspace::Scratch;

/// Standard deviation of how far a lost target moves in a frame, in working pixels.
const COLOR_STD: f64 = 6.0;
/// The least mean foreground of a place that has the target's colours; 0 is a place that says nothing.
const MIN_FOREGROUND: f64 = 0.05;

impl State {
    /// The box of a lost target in the rectified view, and whether the particles speak for this box.
    pub fn place_lost(
        &self,
        image: &Frame,
        search: &SearchContext<'_>,
        scratch: &mut Scratch,
    ) -> (Particle, bool) {
        let candidates = &scratch.candidates;
        let nearby = self.best_nearby(search, scratch).filter(|&index| {
            let score = candidates.score_of(index);
            let distance = candidates.first_distance_of(index);
            self.update_gate.may_follow(score, distance)
        });
        let Some(nearby) = nearby else {
            return (self.place_by_color(search.displaced(), scratch), false);
        };
        let mean = search.answer(&candidates.particles, &candidates.weights, nearby);
        (self.measure_scale(image, mean, scratch), true)
    }

    /// The most likely particle under a prior as narrow as that of a target in view: a wide search decides what is
    /// found again, but a box that follows does not leap.
    fn best_nearby(&self, search: &SearchContext<'_>, scratch: &Scratch) -> Option<usize> {
        let narrow = SearchContext {
            spread: 1.0,
            ..*search
        };
        let candidates = &scratch.candidates;
        let last = self.update_gate.last_distance;
        let mut best = (None, f64::NEG_INFINITY);
        for (index, particle) in candidates.particles.iter().enumerate() {
            let width = prior_width(last, candidates.first_distance_of(index));
            let log_weight = candidates.weights[index].ln() + narrow.log_prior(particle, width)
                - search.log_prior(particle, width);
            if log_weight > best.1 {
                best = (Some(index), log_weight);
            }
        }
        best.0
    }

    /// Of the particles near `home` the one whose box has most of the target's colours, or `home` itself where nothing
    /// there has them.
    fn place_by_color(&self, home: Particle, scratch: &Scratch) -> Particle {
        let mut best = (home, f64::NEG_INFINITY);
        for particle in scratch.candidates.particles.iter().chain([&home]) {
            let place = Particle {
                scale: home.scale,
                ..*particle
            };
            let squared = (place.x - home.x).powi(2) + (place.y - home.y).powi(2);
            let foreground = scratch.foreground.mean(&place, home.scale, &self.bounds);
            let value =
                self.params.histogram_weight * foreground - 0.5 * squared / COLOR_STD.powi(2);
            if foreground > MIN_FOREGROUND && value > best.1 {
                best = (place, value);
            }
        }
        best.0
    }
}
