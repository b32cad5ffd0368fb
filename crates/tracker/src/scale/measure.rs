//! The scale that the filter measures: the maximum of its response, and how much of the change there is applied.
//!
//! The maximum's height measures the certainty: 0.4 to 0.8 on a target in full sight, 0.2 and less where it is covered,
//! turned or missed. There the scale stays, or it would drift within a few frames.

use crate::image::frame::Frame;
use crate::motion::particles::Particle;
use crate::state::State;
use crate::workspace::Scratch;

/// The largest change of the logarithm of the scale in a frame: a maximum further off is mostly a neighbouring object.
const MAX_CHANGE: f64 = 0.06;
/// The share of a change that is applied, so that noise averages out.
const GAIN: f64 = 0.75;
/// √(width · height) in working pixels of a target whose measured scale counts as much as that of the particles.
const HALF_RELIANCE: f64 = 16.0;
/// Up to the first height of the maximum none of the change is applied, from the second on all of it.
pub(crate) const MIN_RESPONSE: f64 = 0.3;
pub(crate) const FULL_RESPONSE: f64 = 0.6;

/// The maximum of the filter's response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Maximum {
    /// The logarithm of the scale at the maximum, against that of the pyramid's middle.
    pub change: f64,
    /// The response y at the maximum.
    pub response: f64,
}

/// How much a measurement counts against the scale of the particles, 0 to 1, of a target with `side` = √(width ·
/// height) working pixels: a pyramid of few pixels tells little.
fn reliance(side: f64) -> f64 {
    1.0 / (1.0 + (HALF_RELIANCE / side).powi(4))
}

impl Maximum {
    /// The change of the logarithm of the scale to apply: bounded, damped, and none where the response is low.
    pub fn gated_change(&self) -> f64 {
        let certainty = (self.response - MIN_RESPONSE) / (FULL_RESPONSE - MIN_RESPONSE);
        let change = self.change.clamp(-MAX_CHANGE, MAX_CHANGE);
        GAIN * certainty.clamp(0.0, 1.0) * change
    }
}

impl State {
    /// `found` with the scale that the filter measures there, against the last answer's; clamped.
    pub fn measure_scale(&self, image: &Frame, found: Particle, scratch: &mut Scratch) -> Particle {
        if !self.scale_filter.has_learned() {
            return self.bounds.clamp(found);
        }
        // A target that was lost may have come nearer, so its last scale does not count.
        let of_last = match self.frames_lost {
            0 => reliance(self.bounds.side(&self.answer)),
            _ => 0.0,
        };
        let scale = found.scale * (self.answer.scale / found.scale).powf(of_last);
        let center = Particle { scale, ..found };
        let (pyramid, extractor) = (&mut scratch.learning.pyramid, &mut scratch.extractor);
        pyramid.describe(image, &center, extractor, &self.bounds, &self.params);
        let change = self.scale_filter.find(pyramid).gated_change();
        let reliance = reliance(self.bounds.side(&center));
        self.bounds.clamp(Particle {
            scale: scale * (reliance * change).exp(),
            ..found
        })
    }
}
