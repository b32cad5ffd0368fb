//! One frame, from the last answer to the next: the paper's components in the order in which they happen.
//!
//! The order matters where things are remembered: what is judged of an answer is judged by what was usual before it, and
//! nothing is learned before it is known whether the answer is believed.

use rand_chacha::ChaCha8Rng;

use crate::tracker::confidence::score::Evidence;
use crate::tracker::estimate::Estimate;
use crate::tracker::features::extractor::Extractor;
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::image::frame_views::FrameViews;
use crate::tracker::motion::particles::{self, Draws, Particle};
use crate::tracker::motion::proposal::{self, SearchContext};
use crate::tracker::params::table::Search;
use crate::tracker::state::State;
use crate::tracker::workspace::Workspace;

impl State {
    /// Finds the target in `frame`, the next one, and learns from it. Returns also what the score is made of.
    pub fn find(&mut self, frame: &GrayFrame, workspace: &mut Workspace) -> (Estimate, Evidence) {
        let number = self.estimate.frame + 1;
        let global_motion = self.global_motion.as_mut();
        let shift = global_motion.map_or((0.0, 0.0), |global_motion| {
            global_motion.shift(frame, &mut workspace.global_motion)
        });
        let rotation = self.rotation();
        let to_original =
            |place: Particle| rotation.map_or(place, |rotation| rotation.to_original(&place));
        let search = SearchContext {
            last: self.answer,
            shift: rotation.map_or(shift, |rotation| rotation.rotated_displacement(shift)),
            search_scale: self.search_scale(),
            params: &self.params,
            bounds: &self.bounds,
        };
        let displaced = search.displaced();
        workspace.begin(self, search.most());
        workspace.rotation = rotation;
        let radius = search.radius() + self.sampling_radius(number);
        let radius = radius.max(search.scanned());
        let mut views = FrameViews::of(frame, self, &mut workspace.views);
        if let Some(rotation) = &rotation {
            let window = Extractor::window(&[self.answer], radius, &self.bounds, &self.params);
            views.orientation(rotation, &window, &mut workspace.views);
        }

        // (A) Where it may be.
        let mut draws = particles::generator(self.params.seed, number, Draws::Particles);
        self.propose(views.rectified(), &search, radius, &mut draws, workspace);
        if self.params.static_penalty > 0.0 {
            workspace.arrival.take(frame);
            workspace.arrival.compare(
                &self.last_seen,
                &to_original(displaced),
                radius,
                &self.bounds,
            );
        }

        // (B) What is seen there, and (D) how that compares with what is known.
        let best = self.weigh(views.rectified(), &search, &mut draws, workspace);
        let evidence = workspace.evidence(best, &self.update_gate);
        let lost = self.is_lost(&evidence);
        let found = if lost {
            displaced
        } else {
            let radius = self.params.averaging_radius;
            let found = proposal::average(&workspace.particles, &workspace.weights, best, radius);
            self.measure_scale(views.rectified(), found, workspace)
        };
        self.frames_lost = if lost {
            self.frames_lost.saturating_add(1)
        } else {
            0
        };
        let answer = self.bounds.clamp(to_original(found));
        let evidence = Evidence {
            scale: answer.scale,
            ..evidence
        };
        let trusted = !lost
            && self
                .update_gate
                .judge(evidence.first_distance, number, &self.params);
        let (score, status) = self.usual.judge(&evidence, lost, trusted);

        // (C) What is to be remembered of it.
        self.answer = answer;
        self.keep_particles(&workspace.particles, &workspace.weights);
        if lost {
            // What is found again is looked for as it was first.
            self.orientation = 0.0;
        } else {
            self.record_seen(&workspace.arrival);
        }
        if trusted && self.passes(score, number) {
            let orientation = self.measure_orientation(views.original(), &evidence, workspace);
            self.answer = found;
            self.learn(views.rectified(), number, workspace);
            (self.answer, self.orientation) = (answer, orientation);
        }
        views.give_back(&mut workspace.views);
        self.estimate = Estimate {
            frame: number,
            target: self.target_of(&answer),
            score,
            status,
        };
        (self.estimate, evidence)
    }

    /// Opens the view on `seen` and draws the first particles.
    fn propose(
        &self,
        seen: &GrayFrame,
        search: &SearchContext<'_>,
        radius: f64,
        draws: &mut ChaCha8Rng,
        workspace: &mut Workspace,
    ) {
        let (bounds, params) = (&self.bounds, &self.params);
        match params.search {
            Search::Resampled => {
                particles::propose(self, draws, &mut workspace.sums, &mut workspace.particles);
                let particles = &workspace.particles;
                workspace
                    .extractor
                    .compute_channels(seen, particles, radius, bounds, params);
            }
            Search::Answer => {
                let answer = [self.answer];
                workspace
                    .extractor
                    .compute_channels(seen, &answer, radius, bounds, params);
                workspace
                    .scan
                    .look(&mut workspace.extractor, search, &self.discriminant);
                search.propose(workspace.scan.maxima(), draws, &mut workspace.particles);
                workspace.scan.prune(search, &mut workspace.particles);
            }
        }
    }

    /// Weighs the particles, draws the rest around the best of them, and weighs all. Returns the likeliest.
    fn weigh(
        &self,
        seen: &GrayFrame,
        search: &SearchContext<'_>,
        draws: &mut ChaCha8Rng,
        workspace: &mut Workspace,
    ) -> usize {
        workspace.extend(seen, 0, self);
        let best = workspace.weigh(search);
        if search.refined() == 0 {
            return best;
        }
        let first = workspace.particles.len();
        search.refine(&workspace.weights, draws, &mut workspace.particles);
        workspace.extend(seen, first, self);
        workspace.weigh(search)
    }
}
