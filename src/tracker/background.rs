//! The metric: what the surroundings of the target look like, and vectors whitened by it.
//!
//! Compared as they are, two patches are alike where both show any edges at all. So vectors of areas beside the target
//! (and of areas that miss it by a third) give a mean and a covariance C, and what is compared is
//! x̂ = M (x - mean) with M = (I + C / ridge)^(-1/2), brought to length 1: directions in which the background varies
//! count less, which is the metric of a linear discriminant analysis. C has the rank of its few samples, so
//! M = I - B diag(g) Bᵀ with the principal directions B of the samples and g = 1 - (1 + eigenvalue / ridge)^(-1/2).
//!
//! Without samples M is the identity and the mean is zero.

use std::collections::VecDeque;

use nalgebra::{DMatrix, SymmetricEigen};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::Params;
use super::look::Look;
use super::matrix;
use super::motion::{Particle, Reach};

/// Areas are off by more than this share of the box along x or y: nearer ones show mostly the target.
const INNER: f64 = 0.3;
/// Areas are off by at most this multiple of the box along x and y.
const OUTER: f64 = 1.5;
/// The box counts as at least this long on a side, in working pixels, so that areas beside a tiny target differ.
const LEAST_SIDE: f64 = 16.0;
/// The share of the samples that a refresh replaces.
const RENEWED: f64 = 0.2;
/// An eigenvalue below this share of the largest is rounding.
const RANK_TOLERANCE: f64 = 1e-5;

/// Vectors of areas beside the target, and the metric they make.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Background {
    /// Oldest first.
    samples: VecDeque<Look>,
    #[serde(skip)]
    metric: Metric,
}

/// A transformation of feature vectors; the identity where there is no background.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Metric {
    mean: Vec<f32>,
    /// B, one direction after the other.
    directions: Vec<f32>,
    /// g of each direction.
    gains: Vec<f32>,
}

impl Background {
    /// How many new samples frame `number` brings: all in the first frame, some in every so many of the others.
    pub fn wanted(number: u64, params: &Params) -> usize {
        let all = params.background_samples as usize;
        if number == 0 {
            all
        } else if number.is_multiple_of(u64::from(params.background_every)) {
            (all as f64 * RENEWED).ceil() as usize
        } else {
            0
        }
    }

    /// Takes new samples, vectors of length D one after the other; the oldest leave.
    pub fn renew(&mut self, vectors: &[f32], params: &Params) {
        for vector in vectors.chunks_exact(params.feature_len()) {
            if self.samples.len() >= params.background_samples as usize {
                self.samples.pop_front();
            }
            self.samples.push_back(Look::new(vector));
        }
        self.learn(params);
    }

    /// Makes the metric of the samples.
    pub fn learn(&mut self, params: &Params) {
        let len = params.feature_len();
        let count = self.samples.len();
        if count < 2 {
            self.metric = Metric::default();
            return;
        }
        let mut vectors = Vec::with_capacity(count * len);
        self.samples
            .iter()
            .for_each(|look| look.append_to(&mut vectors));
        let mut mean = vec![0.0; len];
        for vector in vectors.chunks_exact(len) {
            matrix::add(&mut mean, 1.0 / count as f32, vector);
        }
        for vector in vectors.chunks_exact_mut(len) {
            matrix::add(vector, -1.0, &mean);
        }
        self.metric = Metric::of(mean, &vectors, params.background_ridge);
    }

    /// The metric of the present samples.
    pub fn metric(&self) -> &Metric {
        &self.metric
    }

    /// Whether the samples may be those of a tracker with `params`.
    pub fn is_sound(&self, params: &Params, greatest: f32) -> bool {
        self.samples.len() == params.background_samples as usize
            && self
                .samples
                .iter()
                .all(|look| look.is_sound(params.feature_len(), greatest))
    }
}

/// Draws `count` areas beside the target, as far as they can be had inside the frame.
pub(super) fn areas(
    target: &Particle,
    reach: &Reach,
    count: usize,
    generator: &mut ChaCha8Rng,
) -> Vec<Particle> {
    let width = (reach.box_width * target.scale).max(LEAST_SIDE);
    let height = (reach.box_height * target.scale).max(LEAST_SIDE);
    let draw = |generator: &mut ChaCha8Rng| loop {
        let across = generator.random_range(-OUTER..OUTER);
        let down = generator.random_range(-OUTER..OUTER);
        if across.abs() > INNER || down.abs() > INNER {
            let (x, y) = (target.x + across * width, target.y + down * height);
            return Particle { x, y, ..*target };
        }
    };
    let inside = |area: &Particle| {
        (0.0..=reach.frame_width).contains(&area.x) && (0.0..=reach.frame_height).contains(&area.y)
    };
    // A target that fills the frame has nothing beside it that is inside.
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
    (0..count).map(area).collect()
}

/// How far [`areas`] are from the target's centre at most, in working pixels.
pub(super) fn furthest(target: &Particle, reach: &Reach) -> f64 {
    let longer = reach.box_width.max(reach.box_height) * target.scale;
    OUTER * longer.max(LEAST_SIDE)
}

impl Metric {
    /// The metric of centred `samples` with this mean; `ridge` is a multiple of the covariance's mean eigenvalue.
    fn of(mean: Vec<f32>, samples: &[f32], ridge: f64) -> Self {
        let len = mean.len();
        let count = samples.len() / len;
        let mut gram = Vec::new();
        matrix::inner_products(samples, samples, len, &mut gram);
        let gram = DMatrix::from_fn(count, count, |i, j| f64::from(gram[i * count + j]));
        let ridge = ridge * gram.trace() / count as f64 / len as f64;
        let eigen = SymmetricEigen::new(gram);
        let largest = eigen.eigenvalues.max();
        let mut metric = Self {
            mean,
            ..Self::default()
        };
        if largest.is_nan() || largest <= 0.0 {
            return metric;
        }
        let mut coefficients = Vec::new();
        for (index, &value) in eigen.eigenvalues.iter().enumerate() {
            if value > largest * RANK_TOLERANCE {
                let scale = 1.0 / value.sqrt();
                let column = eigen.eigenvectors.column(index);
                coefficients.extend(column.iter().map(|weight| (weight * scale) as f32));
                let gain = 1.0 - (1.0 + value / count as f64 / ridge).powf(-0.5);
                metric.gains.push(gain as f32);
            }
        }
        metric.directions = vec![0.0; metric.gains.len() * len];
        matrix::add_combinations(&mut metric.directions, 1.0, &coefficients, samples, len);
        metric
    }

    /// The vector that all others are compared with: zero where there is no background.
    pub fn mean(&self) -> &[f32] {
        &self.mean
    }

    /// Turns feature vectors, of length `len` one after the other, into what is compared. `room` is for intermediate
    /// results.
    pub fn apply(&self, vectors: &mut [f32], len: usize, unit_length: bool, room: &mut Vec<f32>) {
        if !self.mean.is_empty() {
            for vector in vectors.chunks_exact_mut(len) {
                matrix::add(vector, -1.0, &self.mean);
            }
            matrix::inner_products(vectors, &self.directions, len, room);
            for row in room.chunks_exact_mut(self.gains.len().max(1)) {
                for (product, gain) in row.iter_mut().zip(&self.gains) {
                    *product *= gain;
                }
            }
            matrix::add_combinations(vectors, -1.0, room, &self.directions, len);
        }
        if unit_length {
            vectors.chunks_exact_mut(len).for_each(matrix::normalize);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::Preset;

    fn params() -> Params {
        Params {
            patch_width: 4,
            patch_height: 4,
            features: crate::tracker::Features::Gray,
            background_samples: 9,
            ..Preset::Robust.params()
        }
    }

    fn vectors(count: usize, seed: usize) -> Vec<f32> {
        let number =
            |i: usize| ((i * i * 31 + i * 7919 + seed * 104_729) % 1000) as f32 / 500.0 - 1.0;
        (0..count * 16).map(number).collect()
    }

    #[test]
    fn whitening_is_the_inverse_root_of_the_covariance_and_the_ridge() {
        let params = params();
        let mut background = Background::default();
        background.renew(&vectors(9, 1), &params);
        let mut samples = Vec::new();
        background
            .samples
            .iter()
            .for_each(|look| look.append_to(&mut samples));
        let samples = DMatrix::from_fn(16, 9, |i, j| f64::from(samples[j * 16 + i]));
        let mean = samples.column_mean();
        let centered = DMatrix::from_fn(16, 9, |i, j| samples[(i, j)] - mean[i]);
        let covariance = &centered * centered.transpose() / 9.0;
        let ridge = params.background_ridge * covariance.trace() / 16.0;
        let eigen = SymmetricEigen::new(covariance / ridge + DMatrix::identity(16, 16));
        let root = eigen.eigenvalues.map(|value| value.powf(-0.5));
        let whitening =
            &eigen.eigenvectors * DMatrix::from_diagonal(&root) * eigen.eigenvectors.transpose();

        let given = vectors(3, 2);
        let mut found = given.clone();
        background
            .metric
            .apply(&mut found, 16, false, &mut Vec::new());
        for (given, found) in given.chunks(16).zip(found.chunks(16)) {
            let given = DMatrix::from_fn(16, 1, |i, _| f64::from(given[i]) - mean[i]);
            let expected = &whitening * given;
            for (expected, found) in expected.iter().zip(found) {
                assert!(
                    (expected - f64::from(*found)).abs() < 1e-4,
                    "{expected} {found}"
                );
            }
        }
    }

    #[test]
    fn without_samples_nothing_changes_but_the_length() {
        let mut found = vectors(2, 3);
        Metric::default().apply(&mut found, 16, false, &mut Vec::new());
        assert_eq!(found, vectors(2, 3));
        Metric::default().apply(&mut found, 16, true, &mut Vec::new());
        let length: f32 = found[..16].iter().map(|value| value * value).sum();
        assert!((length - 1.0).abs() < 1e-5);
    }

    #[test]
    fn equal_samples_make_a_finite_metric() {
        let params = params();
        let mut background = Background::default();
        background.renew(&[0.25; 9 * 16], &params);
        let mut found = vectors(2, 3);
        background
            .metric
            .apply(&mut found, 16, true, &mut Vec::new());
        assert!(found.iter().all(|value| value.is_finite()));
    }
}
