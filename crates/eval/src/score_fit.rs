//! The fit of the score: a logistic regression of hit on the score's predictors.
//!
//! It minimises the mean over the sequences of their mean logistic losses, so that each sequence has the same weight
//! however long it is, plus half the [`RIDGE`] times the sum of the squared coefficients, the intercept's among them.
//! The ridge keeps the coefficients finite where a threshold separates all hits from all misses. The minimum is found
//! by iteratively reweighted least squares (Newton's method; McCullagh and Nelder, *Generalized Linear Models*, 2.5); a
//! step that does not lower the loss is halved.

use bagtrack_tracker::{PREDICTORS, ScoreModel};
use nalgebra::{Cholesky, SMatrix, SVector};

/// Intercept and coefficients.
const COUNT: usize = PREDICTORS.len() + 1;
type Vector = SVector<f64, COUNT>;
type Matrix = SMatrix<f64, COUNT, COUNT>;

/// Small against the curvature that a fraction of a per cent of the frames gives.
pub const RIDGE: f64 = 1e-6;

const MAX_ITERATIONS: usize = 200;
const MAX_HALVINGS: usize = 40;
/// The largest change of a coefficient in a step that ends the search.
const CONVERGED: f64 = 1e-9;

/// One scored frame of one run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// What the score is made of, in the order of [`PREDICTORS`].
    pub predictors: [f64; PREDICTORS.len()],
    /// Whether the box overlaps the annotated one by half or more.
    pub hit: bool,
}

/// Fits the score to the samples, sequence by sequence. None unless there are both hits and misses.
pub fn fit(sequences: &[Vec<Sample>]) -> Option<ScoreModel> {
    let samples = || sequences.iter().flatten();
    if samples().all(|sample| sample.hit) || samples().all(|sample| !sample.hit) {
        return None;
    }
    let mut model = Vector::zeros();
    let mut loss = Loss::at(&model, sequences);
    for _ in 0..MAX_ITERATIONS {
        let Some(curvature) = Cholesky::new(loss.curvature) else {
            break;
        };
        let mut step = curvature.solve(&loss.slope);
        let lower = (0..MAX_HALVINGS).find_map(|_| {
            let next = Loss::at(&(model - step), sequences);
            if next.value <= loss.value {
                return Some(next);
            }
            step /= 2.0;
            None
        });
        let Some(lower) = lower else {
            break;
        };
        model -= step;
        loss = lower;
        if step.amax() < CONVERGED {
            break;
        }
    }
    Some(ScoreModel {
        intercept: model[0],
        coefficients: std::array::from_fn(|index| model[index + 1]),
    })
}

/// The loss at a model, and its first and second derivatives.
struct Loss {
    value: f64,
    slope: Vector,
    curvature: Matrix,
}

impl Loss {
    fn at(model: &Vector, sequences: &[Vec<Sample>]) -> Self {
        let mut loss = Self {
            value: RIDGE / 2.0 * model.norm_squared(),
            slope: RIDGE * model,
            curvature: RIDGE * Matrix::identity(),
        };
        let used = sequences.iter().filter(|samples| !samples.is_empty());
        let count = used.clone().count() as f64;
        for samples in used {
            let weight = 1.0 / count / samples.len() as f64;
            for sample in samples {
                let predictors = sample.predictors.iter().copied();
                let row = Vector::from_iterator(std::iter::once(1.0).chain(predictors));
                let z = model.dot(&row);
                // ln(1 + exp(−z)) of a hit, ln(1 + exp(z)) of a miss.
                let away = if sample.hit { -z } else { z };
                loss.value += weight * (away.max(0.0) + (-away.abs()).exp().ln_1p());
                let chance = 1.0 / (1.0 + (-z).exp());
                loss.slope += weight * (chance - f64::from(u8::from(sample.hit))) * row;
                loss.curvature += weight * chance * (1.0 - chance) * row * row.transpose();
            }
        }
        loss
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn the_coefficients_that_made_the_samples_are_recovered() {
        let made_by = ScoreModel {
            intercept: 1.0,
            coefficients: [3.0, -4.0, -2.0, -6.0],
        };
        let mut generator = ChaCha8Rng::seed_from_u64(3);
        let mut sample = || {
            let predictors = std::array::from_fn(|_| generator.random());
            let hit = generator.random_bool(made_by.probability(&predictors));
            Sample { predictors, hit }
        };
        let sequences: Vec<Vec<Sample>> = [9000, 3000, 6000, 12000]
            .map(|length| (0..length).map(|_| sample()).collect())
            .into();
        let found = fit(&sequences).expect("there are hits and misses");
        // Three standard errors of so many samples.
        assert!(
            (found.intercept - made_by.intercept).abs() < 0.3,
            "{found:?}"
        );
        for (found, made) in found.coefficients.iter().zip(made_by.coefficients) {
            assert!((found - made).abs() < 0.3, "{found} for {made}");
        }
    }

    fn constant(hits: usize, misses: usize) -> Vec<Sample> {
        let sample = |index| Sample {
            predictors: [0.0; PREDICTORS.len()],
            hit: index < hits,
        };
        (0..hits + misses).map(sample).collect()
    }

    #[test]
    fn a_long_sequence_weighs_as_much_as_a_short_one() {
        // Rates of 0.9 and 0.3: the chance is 0.6 whatever the lengths.
        let found = fit(&[constant(900, 100), Vec::new(), constant(3, 7)]).expect("both kinds");
        let chance = found.probability(&[0.0; PREDICTORS.len()]);
        assert!((chance - 0.6).abs() < 1e-4, "{chance}");
    }

    #[test]
    fn hits_apart_from_misses_have_finite_coefficients_and_one_kind_has_none() {
        let sample = |value: f64, hit| Sample {
            predictors: [value, 0.0, -value, 1.0],
            hit,
        };
        let apart = [(0..20).map(|i| sample(f64::from(i), i > 9)).collect()];
        let found = fit(&apart).expect("both kinds");
        assert!(found.coefficients.iter().all(|value| value.is_finite()));
        assert!(found.probability(&sample(12.0, true).predictors) > 0.99);
        assert!(found.probability(&sample(7.0, false).predictors) < 0.01);
        assert_eq!(fit(&[constant(5, 0)]), None);
        assert_eq!(fit(&[constant(0, 5)]), None);
        assert_eq!(fit(&[]), None);
    }
}
