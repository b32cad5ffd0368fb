//! (A) How far the target is turned in the picture, against the first look.
//!
//! A head tilts, a rider leans, a hand turns what it holds. Boxes do not turn, so an upright one slides along the target to
//! where edges still fit, learns that, and stays there. So the picture is turned with the target ([`Rotation`]): everything
//! else sees the target upright, and looks for it around where it was.
//!
//! How far that is, is measured in frames that are learned from: the answer is looked at once more in pictures turned
//! a little further either way, and weighed as particles are. The bag's first subspace does not turn along, so the angle
//! does not wander off with what was learned.

use crate::tracker::confidence::score::Evidence;
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::image::warp::Rotation;
use crate::tracker::params::table::Params;
use crate::tracker::params::table::Search;
use crate::tracker::state::State;
use crate::tracker::workspace::Workspace;

/// Angles that are tried, in steps from the last one. The last one itself says no more: where it is right, the two look alike.
const TRIED: [f64; 2] = [-1.0, 1.0];
/// The share of a change that is taken, so that noise evens out.
const GAIN: f64 = 0.5;
/// How many times as wide the likelihood is as that of places: players who run look turned this way and that, by little.
pub(crate) const SOFTER: f64 = 3.0;
/// Targets are upright rather than not: standard deviation of the angle, in degrees.
const USUAL: f64 = 25.0;
/// The features see little of a turn below this, in degrees, and a picture that is not turned has not to be made.
const LEAST: f64 = 8.0;
/// Greatest distance to the first subspace at which an angle is measured: a look that shares less with the first, as that of a target half
/// covered, is nearer to it at some angle by chance.
const ALIKE: f64 = 0.25;

/// How many particles more than those of a search there are room for.
pub(crate) fn tried(params: &Params) -> usize {
    if is_on(params) { TRIED.len() } else { 0 }
}

/// Whether turns are looked for: where the paper's V is made of former frames, these are upright.
pub(crate) fn is_on(params: &Params) -> bool {
    params.rotation_step > 0.0 && params.single_vector_candidate && params.search == Search::Answer
}

/// Whether `angle`, in radians, may be that of a tracker with `params`.
pub(crate) fn is_valid_for(angle: f64, params: &Params) -> bool {
    angle == 0.0 || is_on(params) && angle.abs() <= std::f64::consts::PI
}

impl State {
    /// The turn that makes the target upright; none where it is.
    pub fn rotation(&self) -> Option<Rotation> {
        let notable = self.orientation.abs() >= LEAST.to_radians();
        notable.then(|| Rotation::about(&self.answer, self.orientation))
    }

    /// The angle by which the target, found at the answer in `frame`, is turned there, in radians; `evidence` is what the best particle said.
    pub fn measure_orientation(
        &self,
        frame: &GrayFrame,
        evidence: &Evidence,
        workspace: &mut Workspace,
    ) -> f64 {
        if !is_on(&self.params) || evidence.first_distance >= ALIKE {
            return self.orientation;
        }
        let changes = TRIED.map(|steps| (steps * self.params.rotation_step).to_radians());
        let angles = changes.map(|change| self.orientation + change);
        let mut weights = angles.map(|angle| -0.5 * (angle / USUAL.to_radians()).powi(2));
        workspace.weigh_rotated(frame, &self.answer, &angles, self, &mut weights);
        let change: f64 = weights.iter().zip(changes).map(|(w, c)| w * c).sum();
        // Half a turn is as far as there is.
        (self.orientation + GAIN * change).clamp(-std::f64::consts::PI, std::f64::consts::PI)
    }
}
