//! (C) What a session learns from a frame.
//!
//! The background is learned before the bag, whose subspaces are fitted under the background's new metric.

use crate::appearance::background;
use crate::appearance::color_histogram::ColorPixels;
use crate::classifier::labels;
use crate::image::frame::Frame;
use crate::motion::particles::Particle;
use crate::motion::random::{self, Draws};
use crate::scale::dsst;
use crate::state::State;
use crate::views::Views;
use crate::workspace::{Learning, Scratch};

/// Where the target was found in frame `number`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Localization {
    pub number: u64,
    /// The answer, in the frame.
    pub answer: Particle,
    /// The answer, in the rectified view.
    pub rectified: Particle,
    /// The best particle's distance to the bag's first subspace.
    pub first_distance: f64,
}

impl State {
    /// Keeps what the next frame starts from. `is_followed` tells whether the particles speak for the box; the target
    /// may be lost all the same.
    pub fn remember(
        &mut self,
        found: &Localization,
        is_lost: bool,
        is_followed: bool,
        scratch: &Scratch,
    ) {
        self.answer = found.answer;
        if let Some(cloud) = &mut self.cloud {
            cloud.particles.clone_from(&scratch.candidates.particles);
            cloud.weights.clone_from(&scratch.candidates.weights);
        }
        if is_lost {
            self.frames_lost = match is_followed {
                true => self.frames_lost.saturating_sub(1),
                false => self.frames_lost.saturating_add(1),
            };
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
        self.orientation = self.measure_orientation(views.working, found, scratch);
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
            let pyramid = &mut scratch.learning.pyramid;
            let extractor = &mut scratch.extractor;
            pyramid.describe(image, at, extractor, &self.bounds, &self.params);
            dsst::learn(&mut self.scale_filter, pyramid, rate);
        }
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
