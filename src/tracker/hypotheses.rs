//! The hypotheses of a frame: particles are proposed, and weighed by all that is known of them.

use rand_chacha::ChaCha8Rng;

use crate::tracker::appearance::color_histogram::ColorPixels;
use crate::tracker::features::extractor::Extractor;
use crate::tracker::image::frame::Frame;
use crate::tracker::image::warp::Rotation;
use crate::tracker::linalg::scratch::clear_and_reserve;
use crate::tracker::motion::search::{self, SearchContext};
use crate::tracker::motion::{orientation, resampling};
use crate::tracker::observe::to_original;
use crate::tracker::params::table::Search;
use crate::tracker::state::State;
use crate::tracker::workspace::Workspace;

impl State {
    /// (A) Draws the first round of particles, in the channels of `image` that it computes.
    pub fn propose(
        &self,
        image: &Frame,
        search: &SearchContext<'_>,
        radius: f64,
        draws: &mut ChaCha8Rng,
        workspace: &mut Workspace,
    ) {
        let (bounds, params) = (&self.bounds, &self.params);
        workspace.candidates.begin(self, orientation::TRIED);
        clear_and_reserve(&mut workspace.log_priors, search::max_count(params));
        clear_and_reserve(&mut workspace.original, search::max_count(params));
        let extractor = &mut workspace.extractor;
        let particles = &mut workspace.candidates.particles;
        match params.search {
            Search::Resampled => {
                let cloud = (&self.particles[..], &self.weights[..]);
                let sums = &mut workspace.sums;
                resampling::resample(cloud, params, bounds, draws, sums, particles);
                extractor.compute_channels(image, particles, radius, bounds, params);
            }
            Search::Answer => {
                extractor.compute_channels(image, &[self.answer], radius, bounds, params);
                let dense_search = &mut workspace.dense_search;
                let foreground = &mut workspace.foreground;
                let pixels = ColorPixels::of(image, self.format.has_color);
                foreground.compute(pixels, &self.color, &self.answer, radius, bounds);
                dense_search.run(extractor, search, &self.discriminant, foreground);
                let cell = Extractor::cell_size(&self.answer, bounds, params);
                search.propose(&dense_search.maxima, cell, draws, particles);
            }
        }
    }

    /// Draws the second round of particles, if there is one, around the best of the first.
    pub fn refine(
        &self,
        search: &SearchContext<'_>,
        draws: &mut ChaCha8Rng,
        workspace: &mut Workspace,
    ) -> bool {
        let (all, first) = search.counts();
        let candidates = &mut workspace.candidates;
        if all > first {
            search.refine(&candidates.weights, draws, &mut candidates.particles);
        }
        all > first
    }

    /// Compares the surroundings with those of the frame in which the target was last seen.
    pub fn test_for_change(
        &self,
        frame: &Frame,
        search: &SearchContext<'_>,
        rotation: Option<&Rotation>,
        radius: f64,
        workspace: &mut Workspace,
    ) {
        if self.params.static_penalty > 0.0 {
            let displaced = to_original(search.displaced(), rotation);
            let test = &mut workspace.change_test;
            test.load(frame, &self.answer, &self.bounds);
            test.compare(&self.last_seen, &displaced, radius, &self.bounds);
        }
    }

    /// (B) and (D) Describes, compares and weighs the particles that were drawn since the last time, in `image`.
    /// Returns the most likely one of all.
    pub fn weigh(
        &self,
        image: &Frame,
        search: &SearchContext<'_>,
        rotation: Option<&Rotation>,
        workspace: &mut Workspace,
    ) -> usize {
        workspace
            .candidates
            .describe_and_compare(image, &mut workspace.extractor, self);
        self.push_log_priors(search, rotation, workspace);
        workspace
            .candidates
            .weigh(&workspace.log_priors, &self.params)
    }

    /// The logarithms of the priors of the new particles: of their displacement, and of whether anything has come
    /// there.
    fn push_log_priors(
        &self,
        search: &SearchContext<'_>,
        rotation: Option<&Rotation>,
        workspace: &mut Workspace,
    ) {
        let known = workspace.log_priors.len();
        let new = &workspace.candidates.particles[known..];
        let weight = self.params.histogram_weight;
        let (foreground, scale) = (&workspace.foreground, self.answer.scale);
        let last = self.update_gate.last_distance;
        let log_priors = new.iter().enumerate().map(|(index, particle)| {
            let distance = workspace.candidates.distances_of(known + index)[0];
            let slack = search::slack(last, distance);
            search.log_prior(particle, slack)
                + weight * foreground.mean(particle, scale, &self.bounds)
        });
        workspace.log_priors.extend(log_priors);
        if self.params.static_penalty > 0.0 {
            workspace.original.clear();
            let original = new.iter().map(|&particle| to_original(particle, rotation));
            workspace.original.extend(original);
            workspace.change_test.penalize(
                &workspace.original,
                &self.bounds,
                self.params.static_penalty,
                &mut workspace.log_priors[known..],
            );
        }
    }
}
