//! The answer that the filter and the expert give together. Chosen on annotated videos (docs/laboratory/ACCURACY.md).

use crate::image::rect::Rect;

/// From this score on the filter is sure. Where the two disagree, the answer is the filter's if the filter is sure,
/// else the expert's.
const SURE: f32 = 0.9;
/// The two agree where their boxes overlap by more than this.
const AGREEMENT: f64 = 0.4;
/// The shares of the expert's box where the two agree and the filter is sure, and where it is not.
const SHARE: f64 = 0.2;
const SHARE_IN_DOUBT: f64 = 0.5;

/// What the filter or the expert says of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Voice {
    /// The box, in working pixels.
    pub target: Rect,
    pub score: f32,
}

/// The box that both give together, in working pixels.
pub(crate) fn fuse(filter: &Voice, expert: &Voice) -> Rect {
    let is_sure = filter.score >= SURE;
    let (answer, other) = (&filter.target, &expert.target);
    if answer.overlap(other) <= AGREEMENT {
        return if is_sure { *answer } else { *other };
    }
    let share = if is_sure { SHARE } else { SHARE_IN_DOUBT };
    let mix = |answer: f64, other: f64| answer + (other - answer) * share;
    let ((x, y), (other_x, other_y)) = (answer.center(), other.center());
    Rect::centered(
        mix(x, other_x),
        mix(y, other_y),
        mix(answer.width.ln(), other.width.ln()).exp(),
        mix(answer.height.ln(), other.height.ln()).exp(),
    )
}

/// The chance that the fused box overlaps the target by half or more: a logistic function of both scores and of how far
/// they agree, near a regression on annotated videos.
pub(crate) fn score(filter: &Voice, expert: &Voice) -> f32 {
    let logit = |score: f32| {
        let chance = f64::from(score).clamp(0.001, 0.999);
        (chance / (1.0 - chance)).ln()
    };
    let overlap = filter.target.overlap(&expert.target);
    let exponent = 0.4 * logit(filter.score) + 0.25 * logit(expert.score) + 2.8 * overlap - 1.7;
    (1.0 / (1.0 + (-exponent).exp())) as f32
}
