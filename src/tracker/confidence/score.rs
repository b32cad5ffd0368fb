//! How sure the tracker is of its answer.
//!
//! With a discriminant the score is a logistic function of four things that each say something else: the
//! discriminant's score (is it the target at all), the distance to the bag's first subspace (does it look as the user
//! saw it), now and lately, since misses last, and how much larger or smaller than the first box the answer is (does
//! the box still fit). Its coefficients are fitted, on annotated videos, some of them played backwards or from their
//! middle, and with the preset `robust`, to whether the box overlaps the target by half or more.
//!
//! Without one, as in the preset `paper`, the score is **not calibrated**: an honest order, not a chance. The distance
//! of the chosen candidate to the nearest entry of the bag is small while the target looks as it did, but what is small
//! differs from video to video. So it is compared with what this session has seen while it was tracking: a running
//! mean of that distance. The score is 1 / (1 + (r / 3)²) of the ratio r, so that a usual frame has 0.9, and three
//! times the usual distance 0.5.

use serde::{Deserialize, Serialize};

use crate::tracker::estimate::Status;

/// The logistic function's constant, and its coefficients of the discriminant's score, of the distance to the first
/// subspace, of what that has been lately, and of the logarithm of the scale. Rounded: what different videos would
/// choose differs by more, and their order of frames does not depend on the last digit. The discriminant's is half as large
/// again as fitted, and the constant less by as much: that orders the frames of the eight videos and of fast clips a little
/// better, and those of five others as well as before.
const CONSTANT: f64 = 4.4;
const OF_DISCRIMINANT: f64 = 4.8;
const OF_FIRST: f64 = -6.4;
const OF_LATELY: f64 = -6.4;
const OF_SCALE: f64 = -2.1;
/// The greatest score of a target that is out of sight: nothing of it is in the box.
const MAX_LOST: f64 = 0.1;

/// A ratio at which the score is a half.
const HALF_RATIO: f64 = 3.0;

/// Below this score the target counts as uncertain, and (without a discriminant) below the next as lost.
const UNCERTAIN_BELOW: f64 = 0.5;
const LOST_BELOW: f64 = 0.2;

/// The share of the newest frame in the running mean.
const RENEWAL: f64 = 0.05;

/// The least usual distance: a still picture must not make the first flicker a loss.
const MIN_USUAL: f64 = 1e-3;

/// What the chosen candidate says about itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Evidence {
    /// Its distance (equation 4) to the first entry of the bag.
    pub first: f64,
    /// The running mean of that distance before this frame.
    pub lately: f64,
    /// Its distance to the nearest entry.
    pub nearest: f64,
    /// The discriminant's score, where there is one.
    pub discriminant: Option<f32>,
    /// Its scale against the first box.
    pub scale: f64,
}

/// What distances have been usual while tracking.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct DistanceBaseline {
    /// The running mean; none before the first frame that was tracked.
    pub distance: Option<f64>,
}

impl DistanceBaseline {
    /// The score in [0, 1] and the status of an answer; `lost` when the target is out of sight, `trusted` when the
    /// frame may be learned from. The frame counts for those to come if it was tracked.
    pub fn judge(&mut self, evidence: &Evidence, lost: bool, trusted: bool) -> (f32, Status) {
        let Some(discriminant) = evidence.discriminant else {
            return self.judge_distance(evidence.nearest);
        };
        let exponent = CONSTANT
            + OF_DISCRIMINANT * f64::from(discriminant)
            + OF_FIRST * evidence.first
            + OF_LATELY * evidence.lately
            + OF_SCALE * evidence.scale.ln().abs();
        let score = 1.0 / (1.0 + (-exponent).exp());
        if lost {
            (score.min(MAX_LOST) as f32, Status::Lost)
        } else if score < UNCERTAIN_BELOW || !trusted {
            (score as f32, Status::Uncertain)
        } else {
            (score as f32, Status::Tracking)
        }
    }

    fn judge_distance(&mut self, distance: f64) -> (f32, Status) {
        let usual = self.distance.unwrap_or(distance).max(MIN_USUAL);
        let ratio = distance / usual / HALF_RATIO;
        let score = 1.0 / (1.0 + ratio * ratio);
        let status = if score < LOST_BELOW {
            Status::Lost
        } else if score < UNCERTAIN_BELOW {
            Status::Uncertain
        } else {
            Status::Tracking
        };
        if status == Status::Tracking {
            self.distance = Some(usual + (distance - usual) * RENEWAL);
        }
        (score as f32, status)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_score_falls_with_the_distance_and_the_usual_follows_only_tracked_frames() {
        let mut usual = DistanceBaseline::default();
        assert_eq!(usual.judge_distance(0.02), (0.9, Status::Tracking));
        let mut last = 1.0;
        for step in 0..40 {
            let (score, _) = usual.clone().judge_distance(f64::from(step) * 0.01);
            assert!(score <= last && (0.0..=1.0).contains(&score));
            last = score;
        }
        assert_eq!(usual.judge_distance(0.08).1, Status::Uncertain);
        assert_eq!(usual.judge_distance(0.3).1, Status::Lost);
        assert_eq!(usual.distance, Some(0.02));
        assert_eq!(usual.judge_distance(0.03).1, Status::Tracking);
        assert!(usual.distance > Some(0.02));
    }

    #[test]
    fn a_still_picture_does_not_make_a_flicker_a_loss() {
        let mut usual = DistanceBaseline::default();
        for _ in 0..100 {
            assert_eq!(usual.judge_distance(0.0).1, Status::Tracking);
        }
        assert_eq!(usual.judge_distance(0.001).1, Status::Tracking);
    }

    #[test]
    fn the_evidence_of_a_discriminant_orders_scores_and_a_loss_is_never_likely() {
        let mut usual = DistanceBaseline::default();
        let mut judge = |discriminant, first, scale, lost, trusted| {
            let evidence = Evidence {
                first,
                lately: 0.2,
                nearest: 0.0,
                discriminant: Some(discriminant),
                scale,
            };
            usual.judge(&evidence, lost, trusted)
        };
        let (sure, status) = judge(1.0, 0.1, 1.0, false, true);
        assert!(sure > 0.9 && status == Status::Tracking);
        assert!(judge(0.6, 0.1, 1.0, false, true).0 < sure);
        assert!(judge(1.0, 0.5, 1.0, false, true).0 < sure);
        assert!(judge(1.0, 0.1, 0.6, false, true).0 < sure);
        assert_eq!(judge(1.0, 0.1, 1.0, false, false).1, Status::Uncertain);
        let (score, status) = judge(0.2, 0.6, 1.0, true, false);
        assert!(score <= 0.1 && status == Status::Lost);
    }
}
