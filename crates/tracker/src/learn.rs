//! (C) What a session learns from a frame.
//!
//! The background comes before the bag: the bag's subspaces are those of vectors under the new metric.

use crate::appearance::background;
use crate::appearance::color_histogram::ColorPixels;
use crate::classifier::labels;
use crate::features::extractor::Extractor;
use crate::image::frame::Frame;
use crate::image::warp::Rotation;
use crate::motion::orientation;
use crate::motion::particles::Particle;
use crate::motion::random::{self, Draws};
use crate::observe::Views;
use crate::scale::{dsst, maximum, pyramid};
use crate::state::State;
use crate::workspace::{Learning, Scratch};

/// Where the target was found in frame `number`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Localization {
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
    pub fn remember(&mut self, found: &Localization, is_lost: bool, scratch: &Scratch) {
        self.answer = found.answer;
        if let Some(cloud) = &mut self.cloud {
            cloud.particles.clone_from(&scratch.candidates.particles);
            cloud.weights.clone_from(&scratch.candidates.weights);
        }
        if is_lost {
            self.frames_lost = self.frames_lost.saturating_add(1);
            // A target that comes back is looked for upright.
            self.orientation = 0.0;
        } else {
            self.frames_lost = 0;
            self.record_seen(scratch);
        }
    }

    /// Records that the target is at the answer in the frame that the change test has loaded.
    pub fn record_seen(&mut self, scratch: &Scratch) {
        if self.params.static_penalty > 0.0 {
            self.last_seen
                .record(self.answer, &scratch.change_test.image);
        }
    }

    /// Updates all models from a frame in which the target was found.
    pub fn learn(&mut self, views: &Views<'_>, found: &Localization, scratch: &mut Scratch) {
        let image = views.rectified;
        let at = &found.rectified;
        self.orientation = self.measure_orientation(views.original, found, scratch);
        self.learn_discriminant(at, scratch);
        self.learn_color(image, at, scratch);
        self.learn_scale(image, at, scratch);
        let model = self.appearance.model();
        let samples = model.background_wanted(found.number, &self.params);
        if samples > 0 {
            let mut draws = random::generator(self.params.seed, found.number, Draws::Samples);
            let areas = &mut scratch.learning.areas;
            background::areas(at, &self.bounds, samples, &mut draws, areas);
            self.learn_background(image, scratch);
        }
        let Learning {
            features,
            appearance,
            ..
        } = &mut scratch.learning;
        let (extractor, params) = (&mut scratch.extractor, &self.params);
        extractor.features(image, &[*at], &self.bounds, params, features);
        let model = self.appearance.model_mut();
        model.learn(features, found.number, params, appearance);
    }

    /// The target's rotation in `original`, in radians: the last one, or moved towards the likelier of two others.
    fn measure_orientation(
        &self,
        original: &Frame,
        found: &Localization,
        scratch: &mut Scratch,
    ) -> f64 {
        let tried = orientation::hypotheses(self.orientation, found.distance, &self.params);
        let Some(tried) = tried else {
            return self.orientation;
        };
        let (answer, bounds, params) = (found.answer, &self.bounds, &self.params);
        let window = Extractor::window(&[answer], 0.0, bounds, params);
        for (view, (angle, _)) in scratch.rotated.iter_mut().zip(tried) {
            let rotation = Rotation::about((answer.x, answer.y), angle);
            view.image = rotation.apply(original, &window, std::mem::take(&mut view.image));
            view.extractor
                .compute_channels(&view.image, &[answer], 0.0, bounds, params);
        }
        let (views, log_priors) = (&mut scratch.rotated, tried.map(|(_, log_prior)| log_prior));
        let sigma = orientation::SIGMA_FACTOR * params.sigma;
        let candidates = &mut scratch.candidates;
        let weights = candidates.weigh_views(answer, views, log_priors, sigma, self);
        orientation::updated(self.orientation, weights)
    }

    /// Fits the discriminant to the frame's particles, labelled by their distance from `at`.
    fn learn_discriminant(&mut self, at: &Particle, scratch: &mut Scratch) {
        if self.discriminant.is_on() {
            let (candidates, fit) = (&scratch.candidates, &mut scratch.learning.fit);
            labels::label_all(&candidates.particles, at, &self.bounds, &mut fit.labels);
            self.discriminant
                .learn(&candidates.samples, candidates.vectors(), fit);
        }
    }

    /// Updates the colour histograms with the box `at`.
    pub fn learn_color(&mut self, image: &Frame, at: &Particle, scratch: &mut Scratch) {
        if self.params.histogram_weight > 0.0 {
            let pixels = ColorPixels::of(image, self.format.has_color);
            let memory = &mut scratch.learning.color;
            self.color.learn(pixels, at, &self.bounds, memory);
        }
    }

    /// Updates the scale filter with the pyramid around `at`.
    pub fn learn_scale(&mut self, image: &Frame, at: &Particle, scratch: &mut Scratch) {
        let rate = self.params.scale_learning_rate;
        if rate > 0.0 {
            self.describe_pyramid(image, at, scratch);
            let pyramid = &mut scratch.learning.pyramid;
            dsst::learn(&mut self.scale_filter, pyramid, rate);
        }
    }

    /// `found` with the scale that the filter measures there, against the last answer's; clamped.
    pub fn measure_scale(&self, image: &Frame, found: Particle, scratch: &mut Scratch) -> Particle {
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
        self.describe_pyramid(image, &center, scratch);
        let found_at = self.scale_filter.find(&mut scratch.learning.pyramid);
        self.bounds.clamp(Particle {
            scale: scale
                * (maximum::reliance(self.bounds.side(&center)) * found_at.gated_change()).exp(),
            ..found
        })
    }

    /// The feature vectors of the pyramid around `center`.
    fn describe_pyramid(&self, image: &Frame, center: &Particle, scratch: &mut Scratch) {
        let memory = &mut scratch.learning.pyramid;
        pyramid::areas(center, &mut memory.areas);
        let (areas, params) = (&memory.areas, pyramid::params(&self.params));
        let (extractor, features) = (&mut scratch.extractor, &mut memory.features);
        extractor.features(image, areas, &self.bounds, &params, features);
    }

    /// Replaces samples of the background by those of the areas in `scratch`.
    pub fn learn_background(&mut self, image: &Frame, scratch: &mut Scratch) {
        let learning = &mut scratch.learning;
        let (areas, features) = (&learning.areas, &mut learning.features);
        scratch
            .extractor
            .features(image, areas, &self.bounds, &self.params, features);
        let model = self.appearance.model_mut();
        model.learn_background(features, &self.params, &mut learning.appearance);
    }
}
