//! One frame, from the last answer to the next: the paper's components in the order in which they happen.
//!
//! The order matters where things are remembered: what is judged of an answer is judged by what was usual before it, and
//! nothing is learned before it is known whether the answer is believed.

use rand_chacha::ChaCha8Rng;

use crate::tracker::workspace::Comparison;
use crate::tracker::motion::particles::{self, Draws, Particle};
use crate::tracker::image::frame_views::Pictures;
use crate::tracker::confidence::score::Evidence;
use crate::tracker::motion::proposal::{self, Sought};
use crate::tracker::state::State;
use crate::tracker::features::extractor::View;
use crate::tracker::estimate::Estimate;
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::params::table::Search;

impl State {
    /// Finds the target in `frame`, the next one, and learns from it.
    pub fn find(&mut self, frame: &GrayFrame, room: &mut Comparison) -> Estimate {
        let number = self.estimate.frame + 1;
        let camera = self.camera.as_mut();
        let shift = camera.map_or((0.0, 0.0), |camera| camera.shift(frame, &mut room.camera));
        let rotation = self.rotation();
        let in_picture =
            |place: Particle| rotation.map_or(place, |rotation| rotation.in_picture(&place));
        let sought = Sought {
            last: self.answer,
            shift: rotation.map_or(shift, |rotation| rotation.turned_shift(shift)),
            widening: self.widening(),
            params: &self.params,
            reach: &self.reach,
        };
        let carried = sought.carried();
        room.begin(self, sought.most());
        room.rotation = rotation;
        let furthest = sought.furthest() + self.learning_radius(number);
        let furthest = furthest.max(sought.scanned());
        let mut pictures = Pictures::of(frame, self, &mut room.pictures);
        if let Some(rotation) = &rotation {
            let window = View::window(&[self.answer], furthest, &self.reach, &self.params);
            pictures.turn(rotation, &window, &mut room.pictures);
        }

        // (A) Where it may be.
        let mut draws = particles::generator(self.params.seed, number, Draws::Particles);
        self.propose(pictures.upright(), &sought, furthest, &mut draws, room);
        if self.params.arrival_weight > 0.0 {
            room.arrival.take(frame);
            room.arrival
                .compare(&self.last_seen, &in_picture(carried), furthest, &self.reach);
        }

        // (B) What is seen there, and (D) how that compares with what is known.
        let best = self.weigh(pictures.upright(), &sought, &mut draws, room);
        let evidence = room.evidence(best, &self.trust);
        let lost = self.is_out_of_sight(&evidence);
        let found = if lost {
            carried
        } else {
            let radius = self.params.averaging_radius;
            let found = proposal::average(&room.particles, &room.weights, best, radius);
            self.measure_scale(pictures.upright(), found, room)
        };
        self.frames_lost = if lost {
            self.frames_lost.saturating_add(1)
        } else {
            0
        };
        let answer = self.reach.hold(in_picture(found));
        let evidence = Evidence {
            scale: answer.scale,
            ..evidence
        };
        let trusted = !lost && self.trust.judge(evidence.first, number, &self.params);
        let (score, status) = self.usual.judge(&evidence, lost, trusted);

        // (C) What is to be remembered of it.
        self.answer = answer;
        self.keep_particles(&room.particles, &room.weights);
        if lost {
            // What is found again is looked for as it was first.
            self.turn = 0.0;
        } else {
            self.see(&room.arrival);
        }
        if trusted && self.believes(score, number) {
            let turn = self.measure_turn(pictures.unturned(), &evidence, room);
            self.answer = found;
            self.learn(pictures.upright(), number, room);
            (self.answer, self.turn) = (answer, turn);
        }
        pictures.give_back(&mut room.pictures);
        self.estimate = Estimate {
            frame: number,
            target: self.target_of(&answer),
            score,
            status,
        };
        self.estimate
    }

    /// Opens the view on `seen` and draws the first particles.
    fn propose(
        &self,
        seen: &GrayFrame,
        sought: &Sought<'_>,
        furthest: f64,
        draws: &mut ChaCha8Rng,
        room: &mut Comparison,
    ) {
        let (reach, params) = (&self.reach, &self.params);
        match params.search {
            Search::Resampled => {
                particles::propose(self, draws, &mut room.sums, &mut room.particles);
                let particles = &room.particles;
                room.view.open(seen, particles, furthest, reach, params);
            }
            Search::Answer => {
                let answer = [self.answer];
                room.view.open(seen, &answer, furthest, reach, params);
                room.scan.look(&mut room.view, sought, &self.discriminant);
                sought.propose(room.scan.peaks(), draws, &mut room.particles);
                room.scan.sift(sought, &mut room.particles);
            }
        }
    }

    /// Weighs the particles, draws the rest around the best of them, and weighs all. Returns the likeliest.
    fn weigh(
        &self,
        seen: &GrayFrame,
        sought: &Sought<'_>,
        draws: &mut ChaCha8Rng,
        room: &mut Comparison,
    ) -> usize {
        room.extend(seen, 0, self);
        let best = room.weigh(sought);
        if sought.refined() == 0 {
            return best;
        }
        let first = room.particles.len();
        sought.refine(&room.weights, draws, &mut room.particles);
        room.extend(seen, first, self);
        room.weigh(sought)
    }
}
