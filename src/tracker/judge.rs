//! How likely an answer is right, and whether the frame may be learned from.

use crate::tracker::confidence::score::Evidence;
use crate::tracker::confidence::update_gate;
use crate::tracker::estimate::Status;
use crate::tracker::state::State;

/// What is thought of an answer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Judgement {
    pub score: f32,
    pub status: Status,
    /// Whether the models may be updated from the frame.
    pub may_learn: bool,
}

impl State {
    /// Judges the answer to frame `number` by its evidence, against the statistics of the frames before, and updates
    /// these.
    pub fn judge(&mut self, number: u64, evidence: &Evidence, is_lost: bool) -> Judgement {
        let is_near = !is_lost && {
            let (distance, has_color) = (evidence.first_distance, self.format.has_color);
            self.update_gate
                .admit_distance(distance, has_color, number, &self.params)
        };
        let (score, status) = self.baseline.judge(evidence, is_lost, is_near);
        // Without a discriminant the score is no probability.
        let is_likely = !self.discriminant.is_on() || update_gate::passes(score, number);
        Judgement {
            score,
            status,
            may_learn: is_near && is_likely,
        }
    }
}
