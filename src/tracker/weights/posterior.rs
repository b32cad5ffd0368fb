//! (D) The weights of all particles of a frame, from their distances and what else is known of them: the sum rule
//! (equations 9 to 11, as in [`likelihood`](crate::tracker::weights::likelihood)) times an exponential for each particle.
//!
//! There are thousands of exponentials a frame, so they are made many at a time, and a likelihood is normalised where it
//! is summed.

use pulp::{Arch, Simd, WithSimd};

use crate::tracker::linalg::exp;
use crate::tracker::linalg::scratch::clear_and_reserve;

/// Room for the weights of a frame.
#[derive(Debug, Default)]
pub(crate) struct Posterior {
    likelihoods: Vec<f64>,
    /// For each entry the least distance, and then what its likelihoods are multiplied by.
    entries: Vec<f64>,
}

/// [`Posterior::weigh`], to be compiled for the instructions that this machine has.
struct Weigh<'a> {
    posterior: &'a mut Posterior,
    distances: &'a [f64],
    sigma: f64,
    pinned: (usize, f64),
    weights: &'a mut [f64],
}

impl WithSimd for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            posterior,
            distances,
            sigma,
            pinned,
            weights,
        } = self;
        posterior.weigh_all(distances, sigma, pinned, weights);
    }
}

impl Posterior {
    /// Forgets the last frame, and makes room for `most` particles and so many entries of the bag.
    pub fn begin(&mut self, most: usize, entries: usize) {
        clear_and_reserve(&mut self.likelihoods, most * entries);
        clear_and_reserve(&mut self.entries, entries);
    }

    /// Makes `weights`, which begin as an exponent for each particle, the product of its exponential and of the sum over
    /// the entries of the particle's likelihoods, each normalised over the particles. `distances` holds for each particle
    /// its distance to each entry; the first `pinned` of these count `pinned_weight` times.
    pub fn weigh(
        &mut self,
        distances: &[f64],
        sigma: f64,
        pinned: (usize, f64),
        weights: &mut [f64],
    ) {
        Arch::new().dispatch(Weigh {
            posterior: self,
            distances,
            sigma,
            pinned,
            weights,
        });
    }

    #[inline(always)]
    fn weigh_all(
        &mut self,
        distances: &[f64],
        sigma: f64,
        (pinned, pinned_weight): (usize, f64),
        weights: &mut [f64],
    ) {
        let entries = distances.len() / weights.len();
        let least = &mut self.entries;
        least.clear();
        least.resize(entries, f64::INFINITY);
        for row in distances.chunks_exact(entries) {
            for (least, distance) in least.iter_mut().zip(row) {
                *least = if *distance < *least {
                    *distance
                } else {
                    *least
                };
            }
        }
        let likelihoods = &mut self.likelihoods;
        likelihoods.clear();
        let share = 1.0 / sigma;
        for row in distances.chunks_exact(entries) {
            let exponents = row.iter().zip(least.iter());
            likelihoods.extend(exponents.map(|(distance, least)| (least - distance) * share));
        }
        exp::exp(likelihoods);
        exp::exp(weights);
        let factors = least;
        factors.fill(0.0);
        for row in likelihoods.chunks_exact(entries) {
            for (sum, likelihood) in factors.iter_mut().zip(row) {
                *sum += likelihood;
            }
        }
        for (k, factor) in factors.iter_mut().enumerate() {
            // Entries that all weigh nothing would be no likelihood at all.
            let weight = if k < pinned && pinned < entries {
                pinned_weight
            } else {
                1.0
            };
            *factor = weight / *factor;
        }
        for (weight, row) in weights.iter_mut().zip(likelihoods.chunks_exact(entries)) {
            let mut sum = 0.0;
            for (likelihood, factor) in row.iter().zip(factors.iter()) {
                sum += likelihood * factor;
            }
            *weight *= sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::weights::likelihood;

    #[test]
    fn weights_are_those_of_the_sum_rule_times_an_exponential() {
        let (particles, entries) = (23, 3);
        let distances: Vec<f64> = (0..particles * entries)
            .map(|i| 0.2 + (i * i % 37) as f64 * 0.003)
            .collect();
        let exponents: Vec<f64> = (0..particles).map(|i| -0.1 * (i % 5) as f64).collect();
        for pinned in [(0, 1.0), (1, 3.0), (3, 0.0), (1, 0.0)] {
            let (mut likelihoods, mut expected) = (Vec::new(), Vec::new());
            likelihood::normalized(&distances, entries, 0.01, &mut likelihoods);
            likelihood::sum_rule(&likelihoods, entries, pinned, &mut expected);
            for (weight, exponent) in expected.iter_mut().zip(&exponents) {
                *weight *= exponent.exp();
            }
            let mut found = exponents.clone();
            Posterior::default().weigh(&distances, 0.01, pinned, &mut found);
            let total = |weights: &[f64]| weights.iter().sum::<f64>();
            let (all_found, all_expected) = (total(&found), total(&expected));
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found / all_found - expected / all_expected).abs() < 1e-14);
            }
        }
    }
}
