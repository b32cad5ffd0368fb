//! A linear score that tells the target from what is beside it.
//!
//! The bag knows what the target has looked like, but not by what it differs from its surroundings, so a twin or a
//! half-missed target may lie near it too. Every frame evaluates hundreds of areas and then knows where the target was:
//! each of them is an example, with a label that falls from 1 at the answer to 0 beside it. The score w · u of the unit
//! vector u of an area is fitted to the labels y by least squares, frame by frame:
//!
//! w ← argmin  mean (w · uᵢ - yᵢ)² + damping · ‖w - w_before‖²
//!
//! so no example is kept, and one frame can change w only so far. A few steps of conjugate gradients do: the damping
//! makes the problem well conditioned. The unit vectors are never written out ([`examples`](crate::tracker::classifier::samples)).

use pulp::{Arch, Simd, WithSimd};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::tracker::classifier::samples::TrainingSamples;
use crate::tracker::linalg::vector_ops;
use crate::tracker::motion::particles::{Particle, StateBounds};
use crate::tracker::motion::random::normal;
use crate::tracker::params::table::Params;

/// Standard deviation of the labels' bell, as a share of the box along x and y, and of the logarithm of the scale.
const LABEL_WIDTH: f64 = 0.15;
/// How strongly w keeps to what it was, against the mean squared error over the samples of a frame.
const DAMPING: f64 = 0.3;
/// Steps of conjugate gradients in a frame.
const STEPS: usize = 5;
/// The first frame knows nothing before it: it is fitted more closely, by this factor of the damping, and longer.
const FIRST_DAMPING: f64 = 0.1;
const FIRST_STEPS: usize = 25;

/// Areas around the first box that the discriminant starts from, and how far they are off: a third of them each of
/// these shares of the box (standard deviations), so that near misses, misses and the surroundings are all known.
const FIRST_AREAS: usize = 300;
const FIRST_STDS: [f64; 3] = [0.1, 0.3, 0.8];
/// The same for the logarithm of their scale, as a share of those.
const FIRST_SCALE_STD: f64 = 0.3;

/// A squared gradient below this says nothing, and its products would underflow: 0 / 0 is no step.
const NOTHING: f32 = 1e-30;

/// The score's state; without vectors the discriminant is off.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Discriminant {
    /// The first frame's mean background, taken from all vectors: w means the same in all frames.
    origin: Vec<f32>,
    weights: Vec<f32>,
}

/// Room for a fit.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// What the labels are, and then how far the scores are from them.
    pub labels: Vec<f32>,
    gradient: Vec<f32>,
    direction: Vec<f32>,
    product: Vec<f32>,
}

/// [`Discriminant::fit`], to be compiled for the instructions that this machine has.
struct Fit<'a> {
    discriminant: &'a mut Discriminant,
    examples: &'a TrainingSamples,
    vectors: &'a [f32],
    damping: f64,
    steps: usize,
    scratch: &'a mut Scratch,
}

impl WithSimd for Fit<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (damping, steps) = (self.damping, self.steps);
        self.discriminant
            .fit_all(self.examples, self.vectors, damping, steps, self.scratch);
    }
}

impl Discriminant {
    /// A discriminant that knows nothing, for feature vectors around `origin` (of length D).
    pub fn new(origin: Vec<f32>) -> Self {
        Self {
            weights: vec![0.0; origin.len()],
            origin,
        }
    }

    /// Whether the discriminant is used.
    pub fn is_on(&self) -> bool {
        !self.weights.is_empty()
    }

    /// w.
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// What is taken from all vectors.
    pub fn origin(&self) -> &[f32] {
        &self.origin
    }

    /// Takes other weights.
    #[cfg(test)]
    pub fn set_weights(&mut self, weights: &[f32]) {
        self.weights.copy_from_slice(weights);
    }

    /// Learns from the first frame.
    pub fn begin(&mut self, examples: &TrainingSamples, vectors: &[f32], scratch: &mut Scratch) {
        let damping = DAMPING * FIRST_DAMPING;
        self.fit(examples, vectors, damping, FIRST_STEPS, scratch);
    }

    /// Learns from a further frame: the examples that its particles are, their vectors, and the labels in `scratch`.
    pub fn learn(&mut self, examples: &TrainingSamples, vectors: &[f32], scratch: &mut Scratch) {
        self.fit(examples, vectors, DAMPING, STEPS, scratch);
    }

    fn fit(
        &mut self,
        examples: &TrainingSamples,
        vectors: &[f32],
        damping: f64,
        steps: usize,
        scratch: &mut Scratch,
    ) {
        Arch::new().dispatch(Fit {
            discriminant: self,
            examples,
            vectors,
            damping,
            steps,
            scratch,
        });
    }

    #[inline(always)]
    fn fit_all(
        &mut self,
        examples: &TrainingSamples,
        vectors: &[f32],
        damping: f64,
        steps: usize,
        scratch: &mut Scratch,
    ) {
        let Scratch {
            labels: residuals,
            gradient,
            direction,
            product,
        } = scratch;
        let damping = damping as f32 * residuals.len() as f32;
        for (residual, score) in residuals.iter_mut().zip(examples.scores()) {
            *residual -= score;
        }
        // Conjugate gradients on (UᵀU + damping) change = Uᵀ residuals.
        gradient.clear();
        gradient.resize(self.weights.len(), 0.0);
        examples.add_sum(vectors, residuals, gradient);
        direction.clone_from(gradient);
        product.resize(gradient.len(), 0.0);
        let mut squared = vector_ops::dot(gradient, gradient);
        let enough = (squared * 1e-10).max(NOTHING);
        for step in 1..=steps {
            if squared <= enough {
                break;
            }
            if step == steps {
                // Nothing is asked of the gradient after it.
                let along = examples.energy(vectors, direction);
                let along = along + damping * vector_ops::dot(direction, direction);
                vector_ops::add(&mut self.weights, squared / along, direction);
                break;
            }
            product.fill(0.0);
            vector_ops::add(product, damping, direction);
            examples.add_products(vectors, direction, product);
            let step = squared / vector_ops::dot(direction, product);
            vector_ops::add(&mut self.weights, step, direction);
            vector_ops::add(gradient, -step, product);
            let before = squared;
            squared = vector_ops::dot(gradient, gradient);
            for (direction, gradient) in direction.iter_mut().zip(gradient.iter()) {
                *direction = gradient + squared / before * *direction;
            }
        }
    }

    /// Whether this may be the discriminant of a tracker with `params`.
    pub fn is_valid_for(&self, params: &Params, greatest: f32) -> bool {
        let len = if params.discriminant_weight > 0.0 {
            params.feature_len()
        } else {
            0
        };
        let bounded = |values: &[f32]| values.iter().all(|value| value.abs() <= greatest);
        self.origin.len() == len
            && self.weights.len() == len
            && bounded(&self.origin)
            && bounded(&self.weights)
    }
}

/// Makes `out` the labels of `areas`.
pub(crate) fn label_all(
    areas: &[Particle],
    target: &Particle,
    bounds: &StateBounds,
    out: &mut Vec<f32>,
) {
    out.clear();
    out.extend(areas.iter().map(|area| label(area, target, bounds)));
}

/// Makes `areas` the target itself and draws around it, for the first fit.
pub(crate) fn first_areas(
    target: &Particle,
    bounds: &StateBounds,
    draws: &mut ChaCha8Rng,
    areas: &mut Vec<Particle>,
) {
    areas.clear();
    areas.push(*target);
    for std in FIRST_STDS.iter().cycle().take(FIRST_AREAS) {
        areas.push(bounds.clamp(Particle {
            x: target.x + std * bounds.box_width * target.scale * normal(draws),
            y: target.y + std * bounds.box_height * target.scale * normal(draws),
            scale: target.scale * (FIRST_SCALE_STD * std * normal(draws)).exp(),
        }));
    }
}

/// How much of the target an area shows, as the discriminant is taught: 1 at `target`, falling as a bell with the
/// distance and the ratio of scales.
fn label(area: &Particle, target: &Particle, bounds: &StateBounds) -> f32 {
    let across = (area.x - target.x) / (bounds.box_width * target.scale);
    let down = (area.y - target.y) / (bounds.box_height * target.scale);
    let larger = (area.scale / target.scale).ln();
    let squared = across * across + down * down + larger * larger;
    (-0.5 * squared / (LABEL_WIDTH * LABEL_WIDTH)).exp() as f32
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
            let mut examples = TrainingSamples::default();
            examples.begin(
                &discriminant.weights,
                &discriminant.origin,
                &vec![mean; len],
                0,
            );
            examples.score_vectors(&shifted);
            let mut scratch = Scratch {
                labels: labels.clone(),
                ..Scratch::default()
            };
            discriminant.fit(&examples, &shifted, 0.2, 60, &mut scratch);

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
                assert!(
                    (expected - f64::from(*found)).abs() < 1e-4,
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
            let mut examples = TrainingSamples::default();
            examples.begin(&discriminant.weights, &discriminant.origin, &[], 0);
            examples.score_vectors(&vectors);
            let mut scratch = Scratch {
                labels: vec![1.0, 0.5],
                ..Scratch::default()
            };
            discriminant.fit(&examples, &vectors, 1e-4, 25, &mut scratch);
            let finite = discriminant.weights.iter().all(|weight| weight.is_finite());
            assert!(finite, "{tiny}: {:?}", discriminant.weights);
        }
    }
}
