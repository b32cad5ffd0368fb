//! One frame, from the last answer to the next: section III of the paper, in its order.
//!
//! An answer is judged against statistics of the frames before it, and nothing is learned before it is judged.

use crate::tracker::confidence::score::Evidence;
use crate::tracker::confidence::update_gate;
use crate::tracker::estimate::Estimate;
use crate::tracker::image::frame::Frame;
use crate::tracker::learn::Found;
use crate::tracker::motion::orientation;
use crate::tracker::motion::random::{self, Draws};
use crate::tracker::observe::to_original;
use crate::tracker::state::State;
use crate::tracker::workspace::Workspace;

impl State {
    /// Finds the target in `frame`, the next one, and learns from it. Returns also what the score is made of.
    pub fn step(&mut self, frame: &Frame, workspace: &mut Workspace) -> (Estimate, Evidence) {
        let number = self.estimate.frame + 1;
        let displacement = self.displacement(frame, workspace);
        let rotation = orientation::rotation(&self.answer, self.orientation);
        let search = self.search(displacement, rotation.as_ref());
        let radius = self.radius(&search, number);
        let original = self.view(frame, workspace);
        let rectified = self.rectified(&original, rotation.as_ref(), radius, workspace);
        let image = rectified.as_ref().unwrap_or(&original);

        // (A) Propose: where the target may be.
        let mut draws = random::generator(self.params.seed, number, Draws::Particles);
        self.propose(image, &search, radius, &mut draws, workspace);
        self.test_for_change(frame, &search, rotation.as_ref(), radius, workspace);

        // (B) Describe, (D) compare and weigh. Twice, since a second round is drawn around the best of the first.
        let mut best = self.weigh(image, &search, rotation.as_ref(), workspace);
        if self.refine(&search, &mut draws, workspace) {
            best = self.weigh(image, &search, rotation.as_ref(), workspace);
        }
        let candidates = &workspace.candidates;

        // Answer (equation 12). A lost target counts as where it was, displaced with the image.
        let evidence = candidates.evidence(best, self.update_gate.mean_distance);
        let (gate, params) = (&self.update_gate, &self.params);
        let is_lost = gate.is_lost(&evidence, self.frames_lost, search.spread, params);
        let found = if is_lost {
            search.displaced()
        } else {
            let mean = search.answer(&candidates.particles, &candidates.weights, best);
            self.measure_scale(image, mean, workspace)
        };
        let answer = self.bounds.clamp(to_original(found, rotation.as_ref()));

        // Judge: how likely the box is right, and whether it may be learned from.
        let scale = answer.scale;
        let evidence = Evidence { scale, ..evidence };
        let is_usual = !is_lost
            && self.update_gate.judge(
                evidence.first_distance,
                self.format.has_color,
                number,
                &self.params,
            );
        let (score, status) = self.baseline.judge(&evidence, is_lost, is_usual);

        // (C) Learn: what is remembered of the frame.
        let found = Found {
            number,
            answer,
            rectified: found,
            distance: evidence.first_distance,
        };
        self.remember(&found, is_lost, workspace);
        // Without a discriminant the score is no probability.
        if is_usual && (!self.discriminant.is_on() || update_gate::passes(score, number)) {
            self.learn(&original, image, &found, workspace);
        }
        workspace.give_back(original, rectified);
        let target = self.target_of(&answer);
        self.estimate = Estimate {
            frame: number,
            target,
            score,
            status,
        };
        (self.estimate, evidence)
    }
}
