//! The target's in-plane rotation, against the first frame.
//!
//! A head tilts, a rider leans. Boxes do not rotate, so an upright box slides along a tilted target to where edges
//! still fit. Therefore the image is rotated back ([`Rotation`]), and everything else sees the target upright.
//!
//! The angle is measured in frames that the models are updated from: the answer is compared once more in images rotated
//! a step further either way, and weighed as particles are. The bag's first subspace does not rotate along, so the
//! angle does not drift with what was learned. While the target stands upright it is measured in every second frame.

use std::f64::consts::PI;

use crate::image::frame::Frame;
use crate::image::warp::Rotation;
use crate::learn::Localization;
use crate::motion::particles::Particle;
use crate::params::table::{Params, Search};
use crate::state::State;
use crate::workspace::Scratch;

/// How many angles are tried: one either way. The last angle itself does not tell which way to turn.
pub(crate) const HYPOTHESES: usize = 2;
/// By how many degrees, either way, a further rotation is tried: heads tilt by some degrees a frame.
const STEP: f64 = 6.0;
/// The share of a measured change that is applied, so that noise evens out.
const GAIN: f64 = 0.5;
/// σ of the likelihood of an angle, as a multiple of that of a place: moving limbs look like small rotations.
const SIGMA_FACTOR: f64 = 3.0;
/// Standard deviation of the prior on the angle, in degrees: targets are upright rather than not.
const PRIOR_STD: f64 = 25.0;
/// Below this angle, in degrees, the image is not rotated: the features hardly change.
const MIN_ANGLE: f64 = 8.0;
/// Below this angle, in degrees, a target stands upright: one measurement alone turns it by less.
const UPRIGHT: f64 = 4.0;
/// An angle is measured only where the distance to the first subspace is below this: a half-covered target is by chance
/// nearer to that subspace at some angle.
const MAX_DISTANCE: f64 = 0.25;

/// Whether rotations are looked for. They are not with the paper's V (equation 2), whose previous patches would stay
/// upright.
pub(crate) fn is_on(params: &Params) -> bool {
    params.single_vector_candidate && params.search == Search::Answer
}

/// Whether `angle`, in radians, may be that of a tracker with `params`.
pub(crate) fn is_valid_for(angle: f64, params: &Params) -> bool {
    angle == 0.0 || is_on(params) && angle.abs() <= PI
}

/// The rotation about `target` that makes it upright; none where it nearly is.
pub(crate) fn rotation(target: &Particle, angle: f64) -> Option<Rotation> {
    let is_notable = angle.abs() >= MIN_ANGLE.to_radians();
    is_notable.then(|| Rotation::about((target.x, target.y), angle))
}

impl State {
    /// The target's rotation in `frame`, in radians: the last one, or moved towards the likelier of two others.
    pub fn measure_orientation(
        &self,
        frame: &Frame,
        found: &Localization,
        scratch: &mut Scratch,
    ) -> f64 {
        if !is_on(&self.params)
            || found.first_distance >= MAX_DISTANCE
            || self.rests_upright(found.number)
        {
            return self.orientation;
        }
        let step = STEP.to_radians();
        let angles = [self.orientation - step, self.orientation + step];
        for (view, angle) in scratch.rotated.iter_mut().zip(angles) {
            view.rotate(frame, found.answer, angle, self);
        }
        let log_priors = angles.map(|angle| -0.5 * (angle / PRIOR_STD.to_radians()).powi(2));
        let (views, sigma) = (&mut scratch.rotated, SIGMA_FACTOR * self.params.sigma);
        let candidates = &mut scratch.candidates;
        let weights = candidates.posterior_in_views(found.answer, views, log_priors, sigma, self);
        let change = (weights[1] - weights[0]) * step;
        // Half a turn is as far as there is.
        (self.orientation + GAIN * change).clamp(-PI, PI)
    }

    /// Whether frame `number` is one of those in which the angle of an upright target is not measured.
    fn rests_upright(&self, number: u64) -> bool {
        self.orientation.abs() < UPRIGHT.to_radians() && !number.is_multiple_of(2)
    }
}
