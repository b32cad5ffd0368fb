//! How sure the tracker is of its answer.
//!
//! With a discriminant the score is a logistic function of four predictors that each say a different thing: the
//! discriminant's score (is it the target at all), the distance to the bag's first subspace (does it look as the user
//! saw it), the running mean of that distance, since a miss lasts for many frames, and how much larger or smaller than
//! the first box the answer is (does the box still fit). It estimates the chance that the box overlaps the target by
//! half or more.
//!
//! Without a discriminant, as in the preset `paper`, the score is **not calibrated**: it orders frames, but is no
//! probability. The distance of the chosen candidate to the nearest entry of the bag is small while the target looks as
//! it did, but what is small differs from video to video. So it is divided by its running mean over the frames of this
//! session that were tracked. The score is 1 / (1 + (r / 3)²) of this ratio r: 0.9 at the mean, 0.5 at three times the
//! mean.

use serde::{Deserialize, Serialize};

use crate::estimate::{Status, UNCERTAIN_BELOW};

/// What the score's predictors are called, in the order of [`Evidence::predictors`].
pub const PREDICTORS: [&str; 4] = [
    "discriminant",
    "first distance",
    "mean first distance",
    "|ln scale|",
];

/// The highest score of a lost target, whose box shows something else.
const MAX_LOST: f64 = 0.1;

/// A ratio at which the score is a half.
const HALF_RATIO: f64 = 3.0;

/// Without a discriminant, below this score the target counts as lost.
const LOST_BELOW: f64 = 0.2;

/// The share of the newest frame in the running mean.
const RATE: f64 = 0.05;

/// The least mean distance: after still frames the first flicker must not count as a loss.
const MIN_BASELINE: f64 = 1e-3;

/// What the score of one frame is made of: the tracker's answer, measured by the tracker itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// The discriminant's score of the chosen candidate, about 1 on the target and 0 on its surroundings. None without
    /// a discriminant.
    pub discriminant: Option<f32>,
    /// The candidate's distance (equation 4) to the first entry of the bag.
    pub first_distance: f64,
    /// The running mean of that distance over the frames before this one.
    pub mean_first_distance: f64,
    /// The candidate's distance to the nearest entry of the bag.
    pub nearest_distance: f64,
    /// The width of the answer's box by that of the first box, above 0.
    pub scale: f64,
}

impl Evidence {
    /// The predictors of a [`ScoreModel`], under the names [`PREDICTORS`]. None without a discriminant.
    pub fn predictors(&self) -> Option<[f64; PREDICTORS.len()]> {
        let discriminant = f64::from(self.discriminant?);
        Some([
            discriminant,
            self.first_distance,
            self.mean_first_distance,
            self.scale.ln().abs(),
        ])
    }
}

/// A logistic model of the score: 1 / (1 + exp(−z)), where z is the intercept and the sum of the predictors, each times
/// its coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ScoreModel {
    /// z where all predictors are 0.
    pub intercept: f64,
    /// The coefficients, one for each of [`PREDICTORS`].
    pub coefficients: [f64; PREDICTORS.len()],
}

impl ScoreModel {
    /// The model that the tracker uses. Set by hand near a logistic regression on annotated videos, with more weight on
    /// the discriminant than the regression gives it. `tools/fit_score.py` prints the regression, and how well the
    /// scores of both models order the frames and hold as chances.
    pub const TRACKER: Self = Self {
        intercept: 4.4,
        coefficients: [4.8, -6.4, -6.4, -2.1],
    };

    /// The chance, in [0, 1], that the box overlaps the target by half or more.
    pub fn probability(&self, predictors: &[f64; PREDICTORS.len()]) -> f64 {
        let terms = self.coefficients.iter().zip(predictors);
        let exponent = terms.fold(self.intercept, |sum, (c, value)| sum + c * value);
        1.0 / (1.0 + (-exponent).exp())
    }

    /// The score, in [0, 1]: the chance, but at most 0.1 for a target that is `lost`.
    pub fn score(&self, predictors: &[f64; PREDICTORS.len()], lost: bool) -> f64 {
        let chance = self.probability(predictors);
        if lost { chance.min(MAX_LOST) } else { chance }
    }
}

/// The running mean of the distance to the nearest entry, over the frames that were tracked.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct DistanceBaseline {
    /// The running mean; none before the first frame that was tracked.
    pub distance: Option<f64>,
}

impl DistanceBaseline {
    /// The score in [0, 1] and the status of an answer; `lost` tells whether the target is lost, `near` whether it is
    /// as near the first subspace as the update gate asks for. Without a discriminant a frame that is tracked enters
    /// the running mean.
    pub fn judge(&mut self, evidence: &Evidence, lost: bool, near: bool) -> (f32, Status) {
        let Some(predictors) = evidence.predictors() else {
            return self.judge_distance(evidence.nearest_distance);
        };
        let score = ScoreModel::TRACKER.score(&predictors, lost);
        let status = if lost {
            Status::Lost
        } else if score < f64::from(UNCERTAIN_BELOW) || !near {
            Status::Uncertain
        } else {
            Status::Tracking
        };
        (score as f32, status)
    }

    fn judge_distance(&mut self, distance: f64) -> (f32, Status) {
        let baseline = self.distance.unwrap_or(distance).max(MIN_BASELINE);
        let ratio = distance / baseline / HALF_RATIO;
        let score = 1.0 / (1.0 + ratio * ratio);
        let status = if score < LOST_BELOW {
            Status::Lost
        } else if score < f64::from(UNCERTAIN_BELOW) {
            Status::Uncertain
        } else {
            Status::Tracking
        };
        if status == Status::Tracking {
            self.distance = Some(baseline + (distance - baseline) * RATE);
        }
        (score as f32, status)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_score_falls_with_the_distance_and_the_baseline_follows_only_tracked_frames() {
        let mut baseline = DistanceBaseline::default();
        assert_eq!(baseline.judge_distance(0.02), (0.9, Status::Tracking));
        let mut last = 1.0;
        for step in 0..40 {
            let (score, _) = baseline.clone().judge_distance(f64::from(step) * 0.01);
            assert!(score <= last && (0.0..=1.0).contains(&score));
            last = score;
        }
        assert_eq!(baseline.judge_distance(0.08).1, Status::Uncertain);
        assert_eq!(baseline.judge_distance(0.3).1, Status::Lost);
        assert_eq!(baseline.distance, Some(0.02));
        assert_eq!(baseline.judge_distance(0.03).1, Status::Tracking);
        assert!(baseline.distance > Some(0.02));
    }

    #[test]
    fn a_still_picture_does_not_make_a_flicker_a_loss() {
        let mut baseline = DistanceBaseline::default();
        for _ in 0..100 {
            assert_eq!(baseline.judge_distance(0.0).1, Status::Tracking);
        }
        assert_eq!(baseline.judge_distance(0.001).1, Status::Tracking);
    }

    #[test]
    fn the_evidence_of_a_discriminant_orders_scores_and_a_loss_is_never_likely() {
        let mut baseline = DistanceBaseline::default();
        let mut judge = |discriminant, first_distance, scale, lost, near| {
            let evidence = Evidence {
                first_distance,
                mean_first_distance: 0.2,
                nearest_distance: 0.0,
                discriminant: Some(discriminant),
                scale,
            };
            baseline.judge(&evidence, lost, near)
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
