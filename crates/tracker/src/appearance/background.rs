//! The background: vectors of areas beside the target, their mean and the metric that they make.
//!
//! Any two patches with edges look similar, so directions in which the background varies count less. Vectors of areas
//! beside the target (and of areas that miss it by a third) give a mean and a covariance C, and vectors are compared by
//! (x - mean)ᵀ (I + C / ridge)⁻¹ (y - mean), as in a linear discriminant analysis ([`Metric`]). Without samples the
//! metric is the plain one and the mean is empty.

use std::collections::VecDeque;

use pulp::{Arch, Simd};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::appearance::mahalanobis::{self, Metric};
use crate::features::quantized::QuantizedVector;
use crate::motion::particles::{Particle, StateBounds};
use crate::params::table::Params;

/// An area is off the target by more than this share of the box along x or y: a nearer one shows mostly the target.
const INNER: f64 = 0.3;
/// An area is off the target by at most this multiple of the box along x and y.
const OUTER: f64 = 1.5;
/// The box counts as at least this long on a side, in working pixels, so that areas beside a tiny target differ.
const MIN_SIDE: f64 = 16.0;
/// Frames from one refresh of the samples to the next.
const REFRESH_EVERY: u64 = 10;
/// The ridge of the covariance, as a multiple of its mean eigenvalue. With this ridge single precision suffices: a
/// vector in the span of the samples keeps one part in D of its squared length.
const RIDGE: f64 = 1.0;
/// The share of the samples that a refresh replaces.
const REFRESHED: f64 = 0.2;

/// Vectors of areas beside the target, and what follows from them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Background {
    /// The samples, oldest first.
    samples: VecDeque<QuantizedVector>,
    /// The mean of the samples; empty without samples.
    #[serde(skip)]
    pub mean: Vec<f32>,
    #[serde(skip)]
    pub metric: Metric,
}

/// Buffers for learning from samples.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    vectors: Vec<f32>,
    metric: mahalanobis::Scratch,
}

impl Background {
    /// How many new samples frame `number` brings: all in frame 0, a share every [`REFRESH_EVERY`] frames, none in
    /// other frames.
    pub fn wanted(number: u64, params: &Params) -> usize {
        let all = params.background_samples as usize;
        if number == 0 {
            all
        } else if number.is_multiple_of(REFRESH_EVERY) {
            (all as f64 * REFRESHED).ceil() as usize
        } else {
            0
        }
    }

    /// Appends new samples, vectors of length D one after the other; the oldest leave.
    pub fn rebuild(&mut self, vectors: &[f32], params: &Params, scratch: &mut Scratch) {
        for vector in vectors.chunks_exact(params.feature_len()) {
            let is_full = self.samples.len() >= params.background_samples as usize;
            let oldest = self.samples.pop_front_if(|_| is_full);
            let mut sample = oldest.unwrap_or_default();
            sample.set(vector);
            self.samples.push_back(sample);
        }
        learn(self, params, scratch);
    }

    /// Copies the mean and the metric of `known` if it has the same samples. Tells whether it has.
    pub fn take_known(&mut self, known: &Self) -> bool {
        let is_known = self.samples == known.samples;
        if is_known {
            self.clone_from(known);
        }
        is_known
    }

    /// Makes `out` the samples, with the mean subtracted: none where there is no metric.
    #[inline(always)]
    pub fn samples_into(&self, out: &mut Vec<f32>) {
        out.resize(self.samples.len() * self.mean.len(), 0.0);
        self.write_samples(out);
    }

    /// Writes the samples, with the mean subtracted, to `out`, which is as long as they are.
    #[inline(always)]
    pub fn write_samples(&self, out: &mut [f32]) {
        let vectors = out.chunks_exact_mut(self.mean.len().max(1));
        for (sample, vector) in self.samples.iter().zip(vectors) {
            sample.write(&self.mean, vector);
        }
    }

    /// Whether the samples may be those of a tracker with `params`.
    pub fn is_valid_for(&self, params: &Params, max: f32) -> bool {
        self.samples.len() == params.background_samples as usize
            && self
                .samples
                .iter()
                .all(|sample| sample.is_valid_for(params.feature_len(), max))
    }
}

/// Computes the mean and the metric from the samples.
#[pulp::with_simd(learn = Arch::new())]
#[inline(always)]
pub(crate) fn learn_simd<S: Simd>(
    _: S,
    background: &mut Background,
    params: &Params,
    scratch: &mut Scratch,
) {
    let (len, count) = (params.feature_len(), background.samples.len());
    background.mean.clear();
    if count < 2 {
        return;
    }
    background.mean.resize(len, 0.0);
    for sample in &background.samples {
        sample.add_to(&mut background.mean, 1.0 / count as f32);
    }
    let (vectors, metric) = (&mut scratch.vectors, &mut scratch.metric);
    background.samples_into(vectors);
    background.metric.fit(vectors, len, RIDGE, metric);
}

/// Draws `count` areas beside the target into `out`. Their centres are in the frame, unless a number of draws finds no
/// such place.
pub(crate) fn areas(
    target: &Particle,
    bounds: &StateBounds,
    count: usize,
    generator: &mut ChaCha8Rng,
    out: &mut Vec<Particle>,
) {
    let width = (bounds.box_width * target.scale).max(MIN_SIDE);
    let height = (bounds.box_height * target.scale).max(MIN_SIDE);
    let draw = |generator: &mut ChaCha8Rng| loop {
        let across = generator.random_range(-OUTER..OUTER);
        let down = generator.random_range(-OUTER..OUTER);
        if across.abs() > INNER || down.abs() > INNER {
            let (x, y) = (target.x + across * width, target.y + down * height);
            return Particle { x, y, ..*target };
        }
    };
    let inside = |area: &Particle| {
        (0.0..=bounds.frame_width).contains(&area.x)
            && (0.0..=bounds.frame_height).contains(&area.y)
    };
    // Beside a target that fills the frame there is no place in the frame, so the number of draws is bounded.
    let tries = 20;
    let area = |_| {
        let mut area = draw(generator);
        for _ in 0..tries {
            if inside(&area) {
                break;
            }
            area = draw(generator);
        }
        area
    };
    out.clear();
    out.extend((0..count).map(area));
}

/// How far [`areas`] are from the target's centre at most, in working pixels.
pub(crate) fn radius(target: &Particle, bounds: &StateBounds) -> f64 {
    let longer = bounds.box_width.max(bounds.box_height) * target.scale;
    OUTER * longer.max(MIN_SIDE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::presets::Preset;

    #[test]
    fn new_samples_replace_the_oldest_and_the_mean_is_theirs() {
        let params = Params {
            patch_width: 4,
            patch_height: 4,
            features: crate::params::table::Features::Gray,
            background_samples: 3,
            ..Preset::Robust.params()
        };
        let (mut background, mut scratch) = (Background::default(), Scratch::default());
        for (first, last, mean) in [(0, 3, 1.0), (3, 4, 2.0), (4, 6, 4.0)] {
            let vectors: Vec<f32> = (first..last).flat_map(|i| [i as f32; 16]).collect();
            background.rebuild(&vectors, &params, &mut scratch);
            assert_eq!(background.samples.len(), 3);
            let is_mean = |value: &f32| (value - mean).abs() < 1e-5;
            assert!(background.mean.iter().all(is_mean));
            let mut samples = Vec::new();
            background.samples_into(&mut samples);
            for (sample, off) in samples.chunks(16).zip([-1.0, 0.0, 1.0]) {
                assert!(sample.iter().all(|value| (value - off).abs() < 1e-5));
            }
        }
    }
}
