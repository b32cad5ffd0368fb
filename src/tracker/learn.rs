//! (C) What a session learns from a frame.
//!
//! The background comes before the bag: the bag's subspaces are those of vectors under the new metric.

use crate::tracker::appearance::background::{self, Background};
use crate::tracker::appearance::bag::Bag;
use crate::tracker::appearance::color_histogram::ColorPixels;
use crate::tracker::classifier::labels;
use crate::tracker::features::extractor::Extractor;
use crate::tracker::image::frame::Frame;
use crate::tracker::image::warp::Rotation;
use crate::tracker::motion::orientation;
use crate::tracker::motion::particles::Particle;
use crate::tracker::motion::random::{self, Draws};
use crate::tracker::scale::{dsst, maximum, pyramid};
use crate::tracker::state::State;
use crate::tracker::workspace::Workspace;

/// Where the target was found in frame `number`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Found {
    pub number: u64,
    /// In the frame.
    pub answer: Particle,
    /// In the rectified view.
    pub rectified: Particle,
    /// The distance to the bag's first subspace.
    pub distance: f64,
}

impl State {
    /// Keeps what the next frame starts from.
    pub fn remember(&mut self, found: &Found, is_lost: bool, workspace: &Workspace) {
        self.answer = found.answer;
        if self.params.stored_particles() > 0 {
            self.particles.clone_from(&workspace.candidates.particles);
            self.weights.clone_from(&workspace.candidates.weights);
        }
        if is_lost {
            self.frames_lost = self.frames_lost.saturating_add(1);
            // A target that comes back is looked for upright.
            self.orientation = 0.0;
        } else {
            self.frames_lost = 0;
            self.record_seen(workspace);
        }
    }

    /// Records that the target is at the answer in the frame that the change test has loaded.
    pub fn record_seen(&mut self, workspace: &Workspace) {
        if self.params.static_penalty > 0.0 {
            self.last_seen
                .record(self.answer, &workspace.change_test.image);
        }
    }

    /// Updates all models from a frame in which the target was found: `image` is its rectified view.
    pub fn learn(
        &mut self,
        original: &Frame,
        image: &Frame,
        found: &Found,
        workspace: &mut Workspace,
    ) {
        let at = &found.rectified;
        self.orientation = self.measure_orientation(original, found, workspace);
        self.learn_discriminant(at, workspace);
        self.learn_color(image, at, workspace);
        self.learn_scale(image, at, workspace);
        let samples = Background::wanted(found.number, &self.params);
        if samples > 0 {
            let mut draws = random::generator(self.params.seed, found.number, Draws::Samples);
            let areas = &mut workspace.learning.areas;
            background::areas(at, &self.bounds, samples, &mut draws, areas);
            self.learn_background(image, workspace);
            let bag = &mut workspace.learning.bag;
            self.bag.rebuild(&self.background, &self.params, bag);
        }
        self.describe_at(image, at, workspace);
        let learning = &mut workspace.learning;
        let features = &mut learning.features;
        if Bag::admits(found.number, &self.params) {
            // V: the answer and the previous frames (equation 2).
            self.history.append_to(features, &self.params);
            let bag = &mut learning.bag;
            self.bag
                .admit(features, &self.background, &self.params, bag);
        }
        self.history.push(features, &self.params);
    }

    /// The target's rotation in `original`, in radians: the last one, or moved towards the likelier of two others.
    fn measure_orientation(
        &self,
        original: &Frame,
        found: &Found,
        workspace: &mut Workspace,
    ) -> f64 {
        let tried = orientation::hypotheses(self.orientation, found.distance, &self.params);
        let Some(tried) = tried else {
            return self.orientation;
        };
        let (candidates, rotated) = (&mut workspace.candidates, &mut workspace.rotated);
        let (answer, bounds, params) = (found.answer, &self.bounds, &self.params);
        let window = Extractor::window(&[answer], 0.0, bounds, params);
        let first = candidates.particles.len();
        for (angle, _) in tried {
            let scratch = std::mem::take(&mut rotated.frame);
            let rotation = Rotation::about((answer.x, answer.y), angle);
            let image = rotation.apply(original, &window, scratch);
            let extractor = &mut rotated.extractor;
            extractor.compute_channels(&image, &[answer], 0.0, bounds, params);
            candidates.particles.push(answer);
            candidates.describe_and_compare(&image, extractor, self);
            rotated.frame = image;
        }
        let mut weights = tried.map(|(_, log_prior)| log_prior);
        let sigma = orientation::SIGMA_FACTOR * params.sigma;
        candidates.weigh_from(first, sigma, params, &mut weights);
        candidates.truncate(first);
        orientation::updated(self.orientation, weights)
    }

    /// Fits the discriminant to the frame's particles, labelled by their distance from `at`.
    fn learn_discriminant(&mut self, at: &Particle, workspace: &mut Workspace) {
        if self.discriminant.is_on() {
            let (candidates, fit) = (&workspace.candidates, &mut workspace.learning.fit);
            labels::label_all(&candidates.particles, at, &self.bounds, &mut fit.labels);
            self.discriminant
                .learn(&candidates.samples, candidates.vectors(), fit);
        }
    }

    /// Updates the colour histograms with the box `at`.
    pub fn learn_color(&mut self, image: &Frame, at: &Particle, workspace: &mut Workspace) {
        if self.params.histogram_weight > 0.0 {
            let pixels = ColorPixels::of(image, self.format.has_color);
            let scratch = &mut workspace.learning.color;
            self.color.learn(pixels, at, &self.bounds, scratch);
        }
    }

    /// Updates the scale filter with the pyramid around `at`.
    pub fn learn_scale(&mut self, image: &Frame, at: &Particle, workspace: &mut Workspace) {
        let rate = self.params.scale_learning_rate;
        if rate > 0.0 {
            self.describe_pyramid(image, at, workspace);
            let pyramid = &mut workspace.learning.pyramid;
            dsst::learn(&mut self.scale_filter, pyramid, rate);
        }
    }

    /// `found` with the scale that the filter measures there, against the last answer's; clamped.
    pub fn measure_scale(
        &self,
        image: &Frame,
        found: Particle,
        workspace: &mut Workspace,
    ) -> Particle {
        if !self.scale_filter.has_learned() {
            return self.bounds.clamp(found);
        }
        // A target that was lost may have come nearer.
        let reliance = match self.frames_lost {
            0 => maximum::reliance(self.bounds.side(&self.answer)),
            _ => 0.0,
        };
        let scale = found.scale * (self.answer.scale / found.scale).powf(reliance);
        let center = Particle { scale, ..found };
        self.describe_pyramid(image, &center, workspace);
        let found_at = self.scale_filter.find(&mut workspace.learning.pyramid);
        self.bounds.clamp(Particle {
            scale: scale
                * (maximum::reliance(self.bounds.side(&center)) * found_at.gated_change()).exp(),
            ..found
        })
    }

    /// The feature vectors of the pyramid around `center`.
    fn describe_pyramid(&self, image: &Frame, center: &Particle, workspace: &mut Workspace) {
        let pyramid::Scratch {
            areas, features, ..
        } = &mut workspace.learning.pyramid;
        pyramid::areas(center, areas);
        let params = pyramid::params(&self.params);
        workspace
            .extractor
            .features(image, areas, &self.bounds, &params, features);
    }

    /// Replaces samples of the background by those of the areas in the workspace.
    pub fn learn_background(&mut self, image: &Frame, workspace: &mut Workspace) {
        let learning = &mut workspace.learning;
        let (areas, features) = (&learning.areas, &mut learning.features);
        workspace
            .extractor
            .features(image, areas, &self.bounds, &self.params, features);
        self.background
            .rebuild(features, &self.params, &mut learning.background);
    }

    /// The feature vector of what is at `at`, as the only one in the workspace.
    pub fn describe_at(&self, image: &Frame, at: &Particle, workspace: &mut Workspace) {
        let features = &mut workspace.learning.features;
        workspace
            .extractor
            .features(image, &[*at], &self.bounds, &self.params, features);
    }
}
