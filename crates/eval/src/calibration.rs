//! How well the score separates hits from misses, and how well it is calibrated as a probability of a hit.
//!
//! An *outcome* is one scored frame of one run: the score that the tracker gave with its box, and whether the box was
//! a *hit*, that is, overlapped the annotated one by at least [`HIT_OVERLAP`](super::HIT_OVERLAP). Frames without an
//! annotation and the first frame, whose box is given, are no outcomes. All outcomes count alike: the figures are over
//! the pooled frames of all videos and seeds, so a long video weighs more than a short one.
//!
//! - [`roc_auc`], the *area under the ROC curve*: the chance that a hit taken at random has a higher score than a miss
//!   taken at random, where equal scores count half (the Mann-Whitney statistic). 0.5 is no better than
//!   chance, 1 separates the two. It depends only on the order of the scores.
//! - [`calibration_error`], the *expected calibration error*: the outcomes are sorted into [`BINS`] bins of equal
//!   width, [0, 0.1), [0.1, 0.2) … [0.9, 1]; in each the mean score is compared with the share of hits, and the
//!   absolute differences are averaged, each bin weighted by its number of outcomes. 0 is a calibrated score.
//! - [`calibration_error_leave_one_out`], the same *leaving one video out*: for each video in turn an [isotonic
//!   regression](Isotonic) of hit on score is fitted to the outcomes of all the *other* videos (all seeds); its value
//!   at each score of the left-out video takes the score's place; then the calibration error is that of all videos'
//!   outcomes pooled, with those chances as scores. It measures how well a map from score to probability, learnt on
//!   some videos, holds on an unseen one; of the served score only the order matters. The seeds of one video are never
//!   split between fitting and evaluation.
//!
//! What can go wrong: calibration alone does not make a good score. A constant equal to the share of hits is
//! calibrated, and within a bin a video with too high scores offsets one with too low scores. So read the figures
//! together with the area under the ROC curve. With only hits or only misses there is no ROC curve, and with one video
//! there is no other to learn from; those figures are then None.

use super::isotonic::Isotonic;
use super::run::Outcome;

/// Number of bins of the calibration error.
pub const BINS: usize = 10;

/// The area under the ROC curve, 0 to 1; None without both hits and misses.
pub fn roc_auc(outcomes: &[Outcome]) -> Option<f64> {
    let mut sorted = outcomes.to_vec();
    sorted.sort_by(|a, b| a.score.total_cmp(&b.score));
    let (mut misses_below, mut won) = (0.0, 0.0);
    for tied in sorted.chunk_by(|a, b| a.score == b.score) {
        let hits = tied.iter().filter(|outcome| outcome.hit).count() as f64;
        let misses = tied.len() as f64 - hits;
        won += hits * (misses_below + misses / 2.0);
        misses_below += misses;
    }
    let pairs = misses_below * (outcomes.len() as f64 - misses_below);
    (pairs > 0.0).then(|| won / pairs)
}

/// The expected calibration error, 0 to 1; None without outcomes.
pub fn calibration_error(outcomes: &[Outcome]) -> Option<f64> {
    // Sums of score and of hits: their difference in a bin is the bin's difference of means times its count.
    let mut bins = [(0.0, 0.0); BINS];
    for outcome in outcomes {
        let bin = ((outcome.score * BINS as f64) as usize).min(BINS - 1);
        bins[bin].0 += outcome.score;
        bins[bin].1 += f64::from(u8::from(outcome.hit));
    }
    let sum: f64 = bins
        .iter()
        .map(|(scores, hits)| (scores - hits).abs())
        .sum();
    (!outcomes.is_empty()).then(|| sum / outcomes.len() as f64)
}

/// The expected calibration error of chances learnt from the other videos, 0 to 1; `videos` are the outcomes video by
/// video. None with fewer than two videos.
pub fn calibration_error_leave_one_out(videos: &[Vec<Outcome>]) -> Option<f64> {
    let mut learnt = Vec::new();
    for (left_out, outcomes) in videos.iter().enumerate() {
        let others: Vec<Outcome> = videos
            .iter()
            .enumerate()
            .filter(|(index, _)| *index != left_out)
            .flat_map(|(_, outcomes)| outcomes.iter().copied())
            .collect();
        let fit = Isotonic::fit(&others)?;
        learnt.extend(outcomes.iter().map(|outcome| Outcome {
            score: fit.chance(outcome.score),
            ..*outcome
        }));
    }
    calibration_error(&learnt)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isotonic::tests::outcomes;

    fn close(found: Option<f64>, expected: f64) {
        let found = found.expect("there is a figure");
        assert!((found - expected).abs() < 1e-12, "{found}, not {expected}");
    }

    #[test]
    fn roc_auc_by_hand() {
        // Hits 0.8, 0.5, 0.4 against misses 0.5, 0.1: won 2, 1 1/2, 1 of 2 each.
        let mixed = outcomes(&[(0.8, 1), (0.5, 1), (0.5, 0), (0.4, 1), (0.1, 0)]);
        close(roc_auc(&mixed), 4.5 / 6.0);
        close(roc_auc(&outcomes(&[(0.9, 1), (0.2, 0), (0.1, 0)])), 1.0);
        close(roc_auc(&outcomes(&[(0.1, 1), (0.2, 0)])), 0.0);
        close(roc_auc(&outcomes(&[(0.5, 1), (0.5, 0), (0.5, 0)])), 0.5);
    }

    #[test]
    fn without_both_kinds_there_is_no_roc_curve() {
        assert_eq!(roc_auc(&outcomes(&[(0.9, 1), (0.2, 1)])), None);
        assert_eq!(roc_auc(&outcomes(&[(0.9, 0)])), None);
        assert_eq!(roc_auc(&[]), None);
    }

    #[test]
    fn calibration_error_by_hand() {
        // [0.2, 0.3): mean score 0.245, one of two a hit. [0.9, 1]: mean score 0.95, both hits. 0.7 alone, a miss.
        let mixed = outcomes(&[(0.2, 0), (0.29, 1), (0.9, 1), (1.0, 1), (0.7, 0)]);
        let by_hand = 2.0 * (0.5 - 0.245) + 2.0 * 0.05 + 0.7;
        close(calibration_error(&mixed), by_hand / 5.0);
        // Just right: three of four at 0.75.
        close(
            calibration_error(&outcomes(&[(0.75, 1), (0.75, 1), (0.75, 0), (0.75, 1)])),
            0.0,
        );
        assert_eq!(calibration_error(&[]), None);
    }

    #[test]
    fn differences_of_different_signs_do_not_cancel_between_bins() {
        close(calibration_error(&outcomes(&[(0.0, 1), (1.0, 0)])), 1.0);
    }

    #[test]
    fn leaving_one_out_learns_from_the_others_only() {
        // Learnt from the second video: 0.3 -> 0, 0.6 -> 1/2; from the first: 0.3 -> 1/2, 0.6 -> 1.
        let first = outcomes(&[(0.3, 0), (0.3, 1), (0.6, 1), (0.6, 1)]);
        let second = outcomes(&[(0.3, 0), (0.3, 0), (0.6, 0), (0.6, 1)]);
        // Chances: first 0, 0, 1/2, 1/2 with hits 0, 1, 1, 1; second 1/2, 1/2, 1, 1 with hits 0, 0, 0, 1.
        // Bin 0: 0 for 1 of 2; bin 5: 2 for 2 of 4; bin 9: 2 for 1 of 2.
        close(
            calibration_error_leave_one_out(&[first.clone(), second]),
            (1.0 + 0.0 + 1.0) / 8.0,
        );
        assert_eq!(calibration_error_leave_one_out(&[first]), None);
    }
}
