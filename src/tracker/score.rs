//! How sure the tracker is of its answer. **Not calibrated**: an honest order, not yet a chance.
//!
//! The distance of the chosen candidate to the nearest entry of the bag is small while the target looks as it did,
//! but what is small differs from video to video. So it is compared with what this session has seen while it was
//! tracking: a running mean of that distance. The score is 1 / (1 + (r / 3)²) of the ratio r, so that a usual frame
//! has 0.9, and three times the usual distance 0.5.

use serde::{Deserialize, Serialize};

use super::Status;

/// A ratio at which the score is a half.
const HALF_RATIO: f64 = 3.0;

/// Below this score the target counts as uncertain, and below the next as lost.
const UNCERTAIN_BELOW: f64 = 0.5;
const LOST_BELOW: f64 = 0.2;

/// The share of the newest frame in the running mean.
const RENEWAL: f64 = 0.05;

/// The least usual distance: a still picture must not make the first flicker a loss.
const LEAST_USUAL: f64 = 1e-3;

/// What distances have been usual while tracking.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Usual {
    /// The running mean; none before the first frame that was tracked.
    pub distance: Option<f64>,
}

impl Usual {
    /// The score in [0, 1] and the status of an answer at `distance` (at least 0) from the nearest entry; the frame
    /// counts for those to come if it was tracked.
    pub fn judge(&mut self, distance: f64) -> (f32, Status) {
        let usual = self.distance.unwrap_or(distance).max(LEAST_USUAL);
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
        let mut usual = Usual::default();
        assert_eq!(usual.judge(0.02), (0.9, Status::Tracking));
        let mut last = 1.0;
        for step in 0..40 {
            let (score, _) = usual.clone().judge(f64::from(step) * 0.01);
            assert!(score <= last && (0.0..=1.0).contains(&score));
            last = score;
        }
        assert_eq!(usual.judge(0.08).1, Status::Uncertain);
        assert_eq!(usual.judge(0.3).1, Status::Lost);
        assert_eq!(usual.distance, Some(0.02));
        assert_eq!(usual.judge(0.03).1, Status::Tracking);
        assert!(usual.distance > Some(0.02));
    }

    #[test]
    fn a_still_picture_does_not_make_a_flicker_a_loss() {
        let mut usual = Usual::default();
        for _ in 0..100 {
            assert_eq!(usual.judge(0.0).1, Status::Tracking);
        }
        assert_eq!(usual.judge(0.001).1, Status::Tracking);
    }
}
