//! One frame, from the last answer to the next: section III of the paper, in its order.
//!
//! An answer is judged against statistics of the frames before it, and nothing is learned before it is judged.

use crate::confidence::score::Evidence;
use crate::confidence::update_gate;
use crate::estimate::{Estimate, Status};
use crate::expert::fusion::Voice;
use crate::expert::opinion::Expert;
use crate::image::frame::Frame;
use crate::input;
use crate::learn::Localization;
use crate::motion::particles::Particle;
use crate::motion::random::{self, Draws};
use crate::state::State;
use crate::workspace::Workspace;

impl State {
    /// Finds the target in `frame`, the next one, and learns from it. Returns also what the filter's score is made of.
    /// `expert` is the one that the session began with.
    pub fn step(
        &mut self,
        frame: &Frame,
        expert: Option<&dyn Expert>,
        workspace: &mut Workspace,
    ) -> (Estimate, Evidence) {
        let Workspace { views, scratch } = workspace;
        let number = self.estimate.frame + 1;
        let displacement = self.displacement(frame, scratch);
        let search = self.search(number, displacement);
        let views = self.views(frame, &search, views);

        // (A) Propose: where the target may be.
        let mut draws = random::generator(self.params.seed, number, Draws::Particles);
        self.propose(views.rectified, &search, &mut draws, scratch);
        self.test_for_change(frame, &search, scratch);

        // (B) Describe, (D) compare and weigh. Twice, since a second round is drawn around the best of the first.
        let mut best = self.weigh_particles(views.rectified, &search, scratch);
        let candidates = &mut scratch.candidates;
        if search.refine(&candidates.weights, &mut draws, &mut candidates.particles) {
            best = self.weigh_particles(views.rectified, &search, scratch);
        }

        // Answer (equation 12). Whether the target is lost, and where the box of a lost target goes, are two decisions.
        let candidates = &scratch.candidates;
        let first_distance = candidates.first_distance_of(best);
        let is_lost = self.update_gate.is_lost(
            candidates.score_of(best),
            first_distance,
            self.was_lost(),
            search.spread,
            &self.params,
        );
        let (rectified, is_followed) = if is_lost {
            self.place_lost(views.rectified, &search, scratch)
        } else {
            let mean = search.answer(&candidates.particles, &candidates.weights, best);
            (self.measure_scale(views.rectified, mean, scratch), true)
        };
        let answer = self.bounds.clamp(search.in_frame(rectified));
        let mut found = Localization {
            number,
            answer,
            rectified,
            first_distance,
        };

        // Judge: how likely the box is right, and whether it may be learned from.
        let mean_distance = self.update_gate.mean_distance;
        let evidence = scratch
            .candidates
            .evidence(best, mean_distance, answer.scale);
        let (score, status, may_learn) = self.judge(number, &evidence, is_lost);
        self.estimate = Estimate {
            frame: number,
            target: self.target_of(&answer),
            score,
            status,
        };
        let is_moved = self.consult(expert, frame, &mut found, is_lost);

        // (C) Learn: what is remembered of the frame.
        self.remember(&found, is_lost, is_followed, scratch);
        if may_learn && !is_moved {
            self.learn(&views, &found, scratch);
        }
        (self.estimate, evidence)
    }

    /// Whether the filter had lost the target, which its expert may still have seen.
    fn was_lost(&self) -> bool {
        match &self.second_opinion {
            Some(opinion) => opinion.filter_lost,
            None => self.estimate.status == Status::Lost,
        }
    }

    /// Asks `expert` for its opinion of the answer, which is that of the filter until then. Returns whether what was
    /// `found` is moved to the expert's place.
    fn consult(
        &mut self,
        expert: Option<&dyn Expert>,
        frame: &Frame,
        found: &mut Localization,
        is_lost: bool,
    ) -> bool {
        let (Some(expert), Some(opinion)) = (expert, &mut self.second_opinion) else {
            return false;
        };
        let filter = Voice {
            target: self.bounds.area(&found.answer),
            score: self.estimate.score,
        };
        let consultation = opinion.consult(expert, frame, &filter, is_lost);
        let (horizontal, vertical) = input::to_working(self.source, self.format.size);
        self.estimate.target = consultation.target.scaled(1.0 / horizontal, 1.0 / vertical);
        self.estimate.score = consultation.score;
        self.estimate.status = Status::of_both(consultation.score, is_lost);
        if let Some((x, y)) = consultation.moved {
            let moved = Particle {
                x,
                y,
                ..found.answer
            };
            found.answer = self.bounds.clamp(moved);
        }
        consultation.moved.is_some()
    }

    /// The score and the status of the answer to frame `number`, and whether the frame may be learned from. Updates the
    /// statistics that later answers are judged against.
    fn judge(&mut self, number: u64, evidence: &Evidence, is_lost: bool) -> (f32, Status, bool) {
        let (distance, has_color) = (evidence.first_distance, self.format.has_color);
        let (gate, params) = (&mut self.update_gate, &self.params);
        let is_near = !is_lost && gate.admit_distance(distance, has_color, number, params);
        let (score, status) = self.baseline.judge(evidence, is_lost, is_near);
        // Without a discriminant the score is no probability.
        let is_likely = !self.discriminant.is_on() || update_gate::passes(score, number);
        (score, status, is_near && is_likely)
    }
}
