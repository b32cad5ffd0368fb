//! The discriminant: a linear classifier of the target against its surroundings, by ridge regression.
//!
//! The bag knows what the target has looked like, but not how it differs from its surroundings, so a look-alike or a
//! half-missed target may be near it too. Every frame compares hundreds of areas, and then it is known where the target
//! was: each area is a training sample, with a label that falls from 1 at the answer to 0 beside it. The score w · u of
//! the unit vector u of an area is fitted to the labels y by least squares, frame by frame:
//!
//! w ← argmin  mean (w · uᵢ - yᵢ)² + damping · ‖w - w_before‖²
//!
//! So no sample is kept, and one frame changes w only a little. A few steps of conjugate gradients are enough: the
//! damping makes the problem well conditioned. The unit vectors are never written out ([`TrainingSamples`]).

use pulp::{Arch, Simd};
use serde::{Deserialize, Serialize};

use crate::classifier::samples::{Coefficients, TrainingSamples};
use crate::linalg::vector_ops;
use crate::params::table::Params;

/// How strongly w keeps to what it was, against the mean squared error over the samples of a frame.
const DAMPING: f64 = 0.3;
/// Steps of conjugate gradients in a frame.
const STEPS: usize = 5;
/// Before the first fit w is 0 and not worth keeping to: that fit has this multiple of the damping, and more steps.
const FIRST_DAMPING: f64 = 0.1;
const FIRST_STEPS: usize = 25;

/// A squared gradient below this is rounding, and its products would underflow to 0 / 0.
const MIN_GRADIENT: f32 = 1e-30;

/// The discriminant's state; without vectors it is off.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Discriminant {
    /// Nearly the first frame's mean background, subtracted from all vectors so that w means the same in all frames.
    pub origin: Vec<f32>,
    /// w, in 8 significant bits.
    pub weights: Vec<f32>,
}

/// Buffers for a fit.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// The labels; a fit turns them into the residuals of the scores.
    pub labels: Vec<f32>,
    gradient: Vec<f32>,
    direction: Vec<f32>,
    product: Vec<f32>,
}

impl Discriminant {
    /// A discriminant with weights of 0, for feature vectors around `origin` (of length D).
    pub fn new(origin: Vec<f32>) -> Self {
        Self {
            weights: vec![0.0; origin.len()],
            origin: origin.iter().map(|x| (x * 32.0).round() / 32.0).collect(),
        }
    }

    /// Whether the discriminant is used.
    pub fn is_on(&self) -> bool {
        !self.weights.is_empty()
    }

    /// The fit to the first frame, with the labels in `scratch`.
    pub fn begin(&mut self, samples: &TrainingSamples, vectors: &[f32], scratch: &mut Scratch) {
        let damping = DAMPING * FIRST_DAMPING;
        fit(self, (samples, vectors), (damping, FIRST_STEPS), scratch);
    }

    /// The fit to a further frame: its particles as samples, their vectors, and their labels in `scratch`.
    pub fn learn(&mut self, samples: &TrainingSamples, vectors: &[f32], scratch: &mut Scratch) {
        fit(self, (samples, vectors), (DAMPING, STEPS), scratch);
    }

    /// Whether this may be the discriminant of a tracker with `params`.
    pub fn is_valid_for(&self, params: &Params, max: f32) -> bool {
        let len = if params.discriminant_weight > 0.0 {
            params.feature_len()
        } else {
            0
        };
        let is_bounded = |value: &f32| value.abs() <= max;
        self.origin.len() == len
            && self.weights.len() == len
            && self.origin.iter().chain(&self.weights).all(is_bounded)
    }
}

#[pulp::with_simd(fit = Arch::new())]
#[inline(always)]
fn fit_simd<S: Simd>(
    simd: S,
    discriminant: &mut Discriminant,
    (samples, vectors): (&TrainingSamples, &[f32]),
    (damping, steps): (f64, usize),
    scratch: &mut Scratch,
) {
    let weights = &mut discriminant.weights;
    let Scratch {
        labels: residuals,
        gradient,
        direction,
        product,
    } = scratch;
    let damping = damping as f32 * residuals.len() as f32;
    for (residual, score) in residuals.iter_mut().zip(&samples.scores) {
        *residual -= score;
    }
    // Conjugate gradients on (UᵀU + damping) change = Uᵀ residuals.
    gradient.clear();
    gradient.resize(weights.len(), 0.0);
    samples.add_sum(simd, vectors, Coefficients::Given(residuals), gradient);
    direction.clone_from(gradient);
    product.resize(gradient.len(), 0.0);
    let mut squared = vector_ops::dot(gradient, gradient);
    let enough = (squared * 1e-10).max(MIN_GRADIENT);
    for step in 1..=steps {
        if squared <= enough {
            break;
        }
        if step == steps {
            // The gradient is not needed after the last step.
            let along = samples.energy(simd, vectors, direction);
            let along = along + damping * vector_ops::dot(direction, direction);
            vector_ops::add(weights, squared / along, direction);
            break;
        }
        product.fill(0.0);
        vector_ops::add(product, damping, direction);
        let coefficients = Coefficients::ProductsWith(direction);
        samples.add_sum(simd, vectors, coefficients, product);
        let step = squared / vector_ops::dot(direction, product);
        vector_ops::add(weights, step, direction);
        vector_ops::add(gradient, -step, product);
        let before = squared;
        squared = vector_ops::dot(gradient, gradient);
        for (direction, gradient) in direction.iter_mut().zip(gradient.iter()) {
            *direction = gradient + squared / before * *direction;
        }
    }
    for weight in weights {
        *weight = vector_ops::to_bfloat16(*weight);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn a_fit_is_the_solution_of_the_normal_equations() {
        // More vectors than a group of them, and a length that is not a whole number of registers.
        let (len, count) = (21, 35);
        let number = |i: usize| ((i * i * 37 + i * 7919) % 1000) as f32 / 500.0 - 1.0;
        let mut discriminant = Discriminant::new((0..len).map(|i| number(i + 77)).collect());
        discriminant.weights = (0..len).map(number).collect();
        let before = discriminant.weights.clone();
        let vectors: Vec<f32> = (0..count * len).map(number).collect();
        let labels: Vec<f32> = (0..count).map(|i| number(i + 500)).collect();
        for mean in [0.0, 0.3] {
            discriminant.weights.clone_from(&before);
            let shifted: Vec<f32> = vectors.iter().map(|value| value - mean).collect();
            let mut samples = TrainingSamples::default();
            samples.begin(
                &discriminant.weights,
                &discriminant.origin,
                &vec![mean; len],
                0,
            );
            samples.score_vectors(&shifted);
            let mut scratch = Scratch {
                labels: labels.clone(),
                ..Scratch::default()
            };
            fit(
                &mut discriminant,
                (&samples, &shifted),
                (0.2, 60),
                &mut scratch,
            );

            let mut u = DMatrix::from_row_slice(count, len, &vectors).cast::<f64>();
            for mut row in u.row_iter_mut() {
                for (value, origin) in row.iter_mut().zip(&discriminant.origin) {
                    *value -= f64::from(*origin);
                }
                row.normalize_mut();
            }
            let before = DVector::from_vec(before.clone()).cast::<f64>();
            let residuals = DVector::from_vec(labels.clone()).cast::<f64>() - &u * &before;
            let normal = u.transpose() * &u + DMatrix::identity(len, len) * (0.2 * count as f64);
            let change = normal.lu().solve(&(u.transpose() * residuals));
            let expected = before + change.expect("a damped matrix is regular");
            for (expected, found) in expected.iter().zip(&discriminant.weights) {
                // To 8 significant bits.
                let tolerance = 1e-4 + expected.abs() / 256.0;
                assert!(
                    (expected - f64::from(*found)).abs() < tolerance,
                    "{expected} {found}"
                );
            }
        }
    }

    #[test]
    fn vectors_whose_squares_underflow_leave_finite_weights() {
        for tiny in [1e-18_f32, 1e-20, 1e-21, 1e-22, 1e-25, 1e-38, 1e-44] {
            let mut discriminant = Discriminant::new(vec![0.0; 4]);
            let vectors = [tiny, 0.0, 0.0, 0.0, 0.0, tiny, 0.0, 0.0];
            let mut samples = TrainingSamples::default();
            samples.begin(&discriminant.weights, &discriminant.origin, &[], 0);
            samples.score_vectors(&vectors);
            let mut scratch = Scratch {
                labels: vec![1.0, 0.5],
                ..Scratch::default()
            };
            fit(
                &mut discriminant,
                (&samples, &vectors),
                (1e-4, 25),
                &mut scratch,
            );
            let finite = discriminant.weights.iter().all(|weight| weight.is_finite());
            assert!(finite, "{tiny}: {:?}", discriminant.weights);
        }
    }
}
