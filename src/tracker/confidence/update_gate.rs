//! Whether a frame may teach the tracker.
//!
//! What is learned while something covers the target is the thing that covers it. The look that the user pointed at
//! does not change, so the distance of the answer to the bag's first subspace tells: it jumps when the target is
//! covered, and creeps when the target turns. A frame is trusted while that distance is below a multiple of what is
//! usual. What is usual follows slowly in frames that are not trusted, too, so that a lasting change is accepted in
//! the end.
//!
//! Where such a jump is usual the score tells: a frame is learned from only if its box is rather right than not.

use serde::{Deserialize, Serialize};

use crate::tracker::confidence::score::Evidence;
use crate::tracker::params::table::Params;

/// A running mean needs some frames before anything can be compared with it; a target that changes fast from the start
/// would never be learned otherwise.
const UNTIL_USUAL: u64 = 20;
/// What counts as usual before anything was seen, and what is always trusted: distances are at most 1, and these are
/// those of a look that shares about half with the first.
const FIRST_USUAL: f64 = 0.25;
const ALWAYS_TRUSTED: f64 = 0.3;
/// A target that has hardly changed so far may have changed this much when it comes back.
const MIN_USUAL: f64 = 0.15;
/// How much better than the lost threshold the discriminant must score a target that is found again.
const FOUND_MARGIN: f64 = 0.2;
/// The share of the newest frame in the running mean, when trusted and when not.
const RENEWAL: f64 = 0.1;
const RENEWAL_UNTRUSTED: f64 = 0.02;

/// Whether frame `number`, whose answer overlaps the target by half or more with the chance `score`, may be learned from. A
/// box that is half off is learned as what the target looks like otherwise, and the next one is further off.
pub(crate) fn passes(score: f64, number: u64, params: &Params) -> bool {
    number < UNTIL_USUAL || score >= params.update_min_score
}

/// What distances to the first subspace have been usual.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct UpdateGate {
    pub mean_distance: f64,
}

impl Default for UpdateGate {
    fn default() -> Self {
        Self {
            mean_distance: FIRST_USUAL,
        }
    }
}

impl UpdateGate {
    /// Whether the best particle is not the target; `frames_lost` tells for how many frames it has been lost, and `spread`
    /// how many times as wide as usual the search was. A wide search finds more that looks a little like the target, so
    /// to be found again takes a better score, and a distance that is recognised.
    pub fn is_lost(
        &self,
        evidence: &Evidence,
        frames_lost: u32,
        spread: f64,
        params: &Params,
    ) -> bool {
        let Some(score) = evidence.discriminant.map(f64::from) else {
            return false;
        };
        if frames_lost == 0 {
            return score < params.lost_threshold;
        }
        score < params.lost_threshold + FOUND_MARGIN
            || !self.recognizes(evidence.first, spread, params)
    }

    /// Whether `distance` from the first subspace is not far beyond what is usual.
    fn accepts(&self, distance: f64, params: &Params) -> bool {
        let limit = (params.update_distance_ratio * self.mean_distance).max(ALWAYS_TRUSTED);
        params.update_distance_ratio <= 0.0 || distance < limit
    }

    /// Whether what is found at `distance` from the first subspace, after the target was out of sight, is the target. The
    /// search was `search_scale` times as wide as usual: one that is hardly wider finds what it lost a frame or two before, and
    /// that is trusted as ever; a wide one finds the likest of all things, so it must look as much like the first look
    /// as is usual.
    pub fn recognizes(&self, distance: f64, search_scale: f64, params: &Params) -> bool {
        let limit = self.mean_distance.max(MIN_USUAL)
            * (1.0 + (params.update_distance_ratio - 1.0) / search_scale);
        params.update_distance_ratio <= 0.0 || distance < limit
    }

    /// Whether frame `number`, whose answer is at `distance` from the first subspace, may be learned from.
    pub fn judge(&mut self, distance: f64, number: u64, params: &Params) -> bool {
        let trusted = number < UNTIL_USUAL || self.accepts(distance, params);
        let renewal = if trusted { RENEWAL } else { RENEWAL_UNTRUSTED };
        self.mean_distance += renewal * (distance - self.mean_distance);
        trusted
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::params::presets::Preset;

    #[test]
    fn a_jump_is_not_trusted_until_it_has_lasted() {
        let params = Preset::Robust.params();
        let mut update_gate = UpdateGate::default();
        assert!((1..50).all(|number| update_gate.judge(0.2, number, &params)));
        let untrusted = (50..500).take_while(|&number| !update_gate.judge(0.6, number, &params));
        let untrusted = untrusted.count();
        assert!((10..100).contains(&untrusted), "{untrusted}");
    }

    #[test]
    fn what_is_hardly_believed_is_not_learned_once_there_were_some_frames() {
        let params = Preset::Robust.params();
        let learned = |score, number| passes(score, number, &params);
        assert!(learned(0.1, UNTIL_USUAL - 1) && learned(0.7, 500));
        assert!(!learned(0.6, UNTIL_USUAL) && !learned(0.1, 500));
        assert!(passes(0.0, 500, &Preset::Paper.params()));
    }

    /// A player who bent down for a moment was not recognised for twelve frames, and then something else was found.
    #[test]
    fn what_was_lost_just_now_is_recognised_more_easily_than_what_a_wide_search_finds() {
        let params = Preset::Robust.params();
        let update_gate = UpdateGate {
            mean_distance: 0.57,
        };
        assert!(update_gate.recognizes(0.6, 1.5, &params));
        assert!(!update_gate.recognizes(0.6, 11.0, &params));
        assert!(update_gate.recognizes(0.55, 11.0, &params));
    }

    #[test]
    fn a_creeping_change_is_trusted_all_along() {
        let params = Preset::Robust.params();
        let mut update_gate = UpdateGate::default();
        assert!((1..200).all(|number| update_gate.judge(
            0.2 + number as f64 * 0.003,
            number,
            &params
        )));
    }
}
