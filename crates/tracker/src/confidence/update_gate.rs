//! The update gate: whether the target is lost, and whether a frame may update the models.
//!
//! A tracker that learns during an occlusion learns the occluder. The first box's subspace does not change, so the
//! distance of the answer to it shows an occlusion: it jumps when the target is covered, and creeps when the target
//! turns. A frame passes while that distance is below a multiple of its running mean. The mean follows slowly in frames
//! that do not pass, too, so a lasting change is accepted in the end.
//!
//! With a discriminant the score decides too: a frame passes only if its box is right about two times of three.

use serde::{Deserialize, Serialize};

use crate::params::table::Params;

/// Frames before the running mean means anything. All of them pass, or a target that changes fast from the start would
/// never be learned.
const WARM_UP: u64 = 20;
/// The running mean before the first frame, and a distance that always passes. Distances are at most 1; these are
/// typical of a patch that shares about half with the first.
const INITIAL_MEAN: f64 = 0.25;
const ALWAYS_ACCEPTED: f64 = 0.3;
/// What the limit is multiplied by in colour: colour keeps the distance of a turning target steadier, and makes that of
/// an occluder larger.
const COLOR_STRICTNESS: f64 = 0.8;
/// The least mean against which a target that was lost is recognised: the mean of a target that has hardly changed so
/// far would be stricter.
const MIN_MEAN: f64 = 0.15;
/// The least score of a frame that passes: its box is right twice as often as wrong. A box that is half off would be
/// learned as the target, and the next box would be further off.
const MIN_SCORE: f32 = 0.65;
/// Below this score of the discriminant the target is lost: nothing is learned, and the search widens from frame to
/// frame until the target is found again. It narrows in frames in which the box follows the particles. The discriminant
/// says 0.5 to 1 on the target, and about 0.1 beside it.
const LOST_THRESHOLD: f64 = 0.35;
/// How much better than the lost threshold the discriminant must score a target that is found again.
const FOUND_MARGIN: f64 = 0.2;
/// From this score of the discriminant on, and below this multiple of the mean distance to the first subspace, the box
/// of a lost target follows its particles. An occluder has such a score as often as a target that has turned, but it is
/// further from the first image.
const FOLLOWED_SCORE: f64 = 0.2;
const FOLLOWED_RATIO: f64 = 1.2;
/// The share of the newest frame in the running mean, where it passes and where it does not.
const RATE: f64 = 0.1;
const RATE_REJECTED: f64 = 0.02;

/// Whether frame `number` may update the models; `score` is the probability that its box overlaps the target by half or
/// more.
pub(crate) fn passes(score: f32, number: u64) -> bool {
    number < WARM_UP || score >= MIN_SCORE
}

/// The answers' distances to the first subspace, but for those of frames in which the target was lost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct UpdateGate {
    /// The running mean.
    pub mean_distance: f64,
    /// The last of these distances; 0 before the first.
    pub last_distance: f64,
}

impl Default for UpdateGate {
    fn default() -> Self {
        Self {
            mean_distance: INITIAL_MEAN,
            last_distance: 0.0,
        }
    }
}

impl UpdateGate {
    /// Whether the target is lost: whether the best particle, with this score of the discriminant and this distance to
    /// the first subspace, shows something else. `was_lost` tells whether the target was lost in the last frame; the
    /// search was `spread` times as wide as usual. A wide search finds more that resembles the target a little, so a
    /// target that is found again needs a better score and a recognised distance. Without a discriminant no target is
    /// lost.
    pub fn is_lost(
        &self,
        score: Option<f32>,
        distance: f64,
        was_lost: bool,
        spread: f64,
        params: &Params,
    ) -> bool {
        let Some(score) = score.map(f64::from) else {
            return false;
        };
        if !was_lost {
            return score < LOST_THRESHOLD;
        }
        score < LOST_THRESHOLD + FOUND_MARGIN || !self.recognizes(distance, spread, params)
    }

    /// Whether the box of a lost target goes to a particle with this score of the discriminant and this distance to the
    /// first subspace.
    pub fn may_follow(&self, score: Option<f32>, distance: f64) -> bool {
        score.is_some_and(|score| f64::from(score) >= FOLLOWED_SCORE)
            && distance < FOLLOWED_RATIO * self.mean_distance.max(MIN_MEAN)
    }

    /// Whether what is found at `distance` from the first subspace is the target that was lost. A search that is hardly
    /// wider than usual finds what it lost a frame or two before, and the usual limit holds. A wide search returns the
    /// nearest look-alike, so the limit falls to the mean itself.
    fn recognizes(&self, distance: f64, spread: f64, params: &Params) -> bool {
        let factor = 1.0 + (params.update_distance_ratio - 1.0) / spread;
        let limit = self.mean_distance.max(MIN_MEAN) * factor;
        params.update_distance_ratio <= 0.0 || distance < limit
    }

    /// Whether frame `number`, whose answer is at `distance` from the first subspace, may update the models as far as
    /// the distance tells; updates the statistics.
    pub fn admit_distance(
        &mut self,
        distance: f64,
        has_color: bool,
        number: u64,
        params: &Params,
    ) -> bool {
        let strictness = if has_color { COLOR_STRICTNESS } else { 1.0 };
        let limit =
            (strictness * params.update_distance_ratio * self.mean_distance).max(ALWAYS_ACCEPTED);
        let accepted = params.update_distance_ratio <= 0.0 || distance < limit;
        let passes = number < WARM_UP || accepted;
        let rate = if passes { RATE } else { RATE_REJECTED };
        self.mean_distance += rate * (distance - self.mean_distance);
        self.last_distance = distance;
        passes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::presets::Preset;

    #[test]
    fn a_jump_does_not_pass_until_it_has_lasted() {
        let params = Preset::Robust.params();
        let mut gate = UpdateGate::default();
        assert!((1..50).all(|number| gate.admit_distance(0.2, false, number, &params)));
        let rejected =
            (50..500).take_while(|&number| !gate.admit_distance(0.6, false, number, &params));
        let rejected = rejected.count();
        assert!((10..100).contains(&rejected), "{rejected}");
    }

    #[test]
    fn a_low_score_does_not_pass_after_the_warm_up() {
        assert!(passes(0.1, WARM_UP - 1) && passes(0.7, 500));
        assert!(!passes(0.6, WARM_UP) && !passes(0.1, 500));
    }

    /// A walker in full view who turned away was lost, and the box stayed behind. A sign that covered a car had the
    /// same score, and would have taken the box along.
    #[test]
    fn a_doubted_target_is_followed_and_an_occluder_is_not() {
        let params = Preset::Robust.params();
        let gate = UpdateGate {
            mean_distance: 0.4,
            ..UpdateGate::default()
        };
        assert!(gate.is_lost(Some(0.25), 0.45, false, 1.0, &params));
        assert!(gate.may_follow(Some(0.25), 0.45));
        assert!(!gate.may_follow(Some(0.25), 0.6));
        assert!(!gate.may_follow(Some(0.1), 0.45) && !gate.may_follow(None, 0.45));
    }

    /// A player who bent down for a moment was not recognised for twelve frames, and then something else was found.
    #[test]
    fn a_narrow_search_recognises_more_easily_than_a_wide_one() {
        let params = Preset::Robust.params();
        let gate = UpdateGate {
            mean_distance: 0.57,
            ..UpdateGate::default()
        };
        assert!(gate.recognizes(0.6, 1.5, &params));
        assert!(!gate.recognizes(0.6, 11.0, &params));
        assert!(gate.recognizes(0.55, 11.0, &params));
    }

    #[test]
    fn a_creeping_change_passes_all_along() {
        let params = Preset::Robust.params();
        let mut gate = UpdateGate::default();
        assert!((1..200).all(|number| gate.admit_distance(
            0.2 + number as f64 * 0.003,
            false,
            number,
            &params
        )));
    }
}
