//! (A) Particles are proposed, and weighed by all that is known of them.

use rand_chacha::ChaCha8Rng;

use crate::appearance::color_histogram::ColorPixels;
use crate::features::extractor::Extractor;
use crate::image::frame::Frame;
use crate::linalg::scratch::clear_and_reserve;
use crate::motion::orientation;
use crate::motion::search::{self, SearchContext};
use crate::state::State;
use crate::workspace::Scratch;

impl State {
    /// (A) Computes the channels of `image` and draws the first round of particles.
    pub fn propose(
        &self,
        image: &Frame,
        search: &SearchContext<'_>,
        draws: &mut ChaCha8Rng,
        scratch: &mut Scratch,
    ) {
        let (bounds, params, radius) = (&self.bounds, &self.params, search.window_radius());
        scratch.candidates.begin(self, orientation::HYPOTHESES);
        clear_and_reserve(&mut scratch.log_priors, search::max_count(params));
        clear_and_reserve(&mut scratch.in_frame, search::max_count(params));
        let extractor = &mut scratch.extractor;
        let particles = &mut scratch.candidates.particles;
        let foreground = &mut scratch.foreground;
        let pixels = ColorPixels::of(image, self.format.has_color);
        foreground.compute(pixels, &self.color, &self.answer, radius, bounds);
        match &self.cloud {
            Some(cloud) => {
                cloud.resample(params, bounds, draws, &mut scratch.sums, particles);
                extractor.compute_channels(image, particles, radius, bounds, params);
            }
            None => {
                extractor.compute_channels(image, &[self.answer], radius, bounds, params);
                let dense_search = &mut scratch.dense_search;
                dense_search.run(extractor, search, &self.discriminant, foreground);
                let cell = Extractor::cell_size(&self.answer, bounds, params);
                search.propose(&dense_search.maxima, cell, draws, particles);
            }
        }
    }

    /// Compares the surroundings with those of the frame in which the target was last seen.
    pub fn test_for_change(
        &self,
        frame: &Frame,
        search: &SearchContext<'_>,
        scratch: &mut Scratch,
    ) {
        if self.params.static_penalty > 0.0 {
            let displaced = search.in_frame(search.displaced());
            let test = &mut scratch.change_test;
            test.load(frame, &self.answer, &self.bounds);
            test.compare(
                &self.last_seen,
                &displaced,
                search.window_radius(),
                &self.bounds,
            );
        }
    }

    /// (B) and (D) Describes, compares and weighs the particles that were drawn since the last call, in `image`.
    /// Returns the index of the most likely of all particles.
    pub fn weigh_particles(
        &self,
        image: &Frame,
        search: &SearchContext<'_>,
        scratch: &mut Scratch,
    ) -> usize {
        scratch
            .candidates
            .describe_and_compare(image, &mut scratch.extractor, self);
        self.push_log_priors(search, scratch);
        scratch
            .candidates
            .posterior(&scratch.log_priors, &self.params)
    }

    /// Appends the logarithms of the priors of the new particles: of their displacement, of the colours in their boxes,
    /// and of whether anything has come there.
    fn push_log_priors(&self, search: &SearchContext<'_>, scratch: &mut Scratch) {
        let known = scratch.log_priors.len();
        let new = &scratch.candidates.particles[known..];
        let weight = self.params.histogram_weight;
        let (foreground, scale) = (&scratch.foreground, self.answer.scale);
        let last = self.update_gate.last_distance;
        let log_priors = new.iter().enumerate().map(|(index, particle)| {
            let distance = scratch.candidates.first_distance_of(known + index);
            let prior_width = search::prior_width(last, distance);
            search.log_prior(particle, prior_width)
                + weight * foreground.mean(particle, scale, &self.bounds)
        });
        scratch.log_priors.extend(log_priors);
        if self.params.static_penalty > 0.0 {
            scratch.in_frame.clear();
            let in_frame = new.iter().map(|&particle| search.in_frame(particle));
            scratch.in_frame.extend(in_frame);
            scratch.change_test.penalize(
                &scratch.in_frame,
                &self.bounds,
                self.params.static_penalty,
                &mut scratch.log_priors[known..],
            );
        }
    }
}
