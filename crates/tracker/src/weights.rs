//! (D) From distances to the weights of the particles (equations 9 to 12).
//!
//! In: N x K distances in \[0, 1\], σ, and for each particle the logarithm of its prior. Out: N weights with the sum 1.
//! exp(-dist / σ) underflows for every candidate as soon as the nearest is some hundred σ away, and 0 / 0 is no
//! likelihood. Equation 10 normalises over the candidates, so the least distance to an entry may be subtracted from all
//! distances to that entry first: the result is the same, and the largest term is always 1.

use pulp::{Arch, Simd};

/// Where an exponent is larger, all are taken relative to the largest: e^710 overflows, and a sum of many exponentials
/// must not.
const MAX_EXPONENT: f64 = 600.0;

/// The likelihoods of a frame's particles; keeps its buffers.
#[derive(Debug, Clone, Default)]
pub struct Likelihoods {
    /// p̂(Aᵢ | B\[k\]): for each particle its likelihood for each entry.
    values: Vec<f64>,
    /// For each entry the least distance, and then the sum over the particles.
    entries: Vec<f64>,
}

/// Computes the likelihoods of `distances`, which hold for each particle its distance to each entry of the bag, and
/// from them `weights`, one for each particle.
///
/// On entry `weights` holds an exponent for each particle, the logarithm of its prior (0 for none). On return a weight
/// is the exponential of that exponent times the sum of the particle's likelihoods over the bag (equation 9), scaled so
/// that all sum to 1. In the sum the first `pinned.0` entries count `pinned.1` times.
#[pulp::with_simd(sum_rule_weights = Arch::new())]
#[inline(always)]
pub fn sum_rule_weights_simd<S: Simd>(
    _: S,
    likelihoods: &mut Likelihoods,
    distances: &[f64],
    sigma: f64,
    pinned: (usize, f64),
    weights: &mut [f64],
) {
    let entries = distances.len() / weights.len();
    likelihoods.normalize(distances, entries, sigma);
    let largest = weights.iter().copied().fold(0.0, f64::max);
    if largest > MAX_EXPONENT {
        weights.iter_mut().for_each(|weight| *weight -= largest);
    }
    exponentials(weights);
    likelihoods.sum_rule(entries, pinned, weights);
}

impl Likelihoods {
    /// Makes room for so many particles and entries of the bag.
    pub(crate) fn reserve(&mut self, particles: usize, entries: usize) {
        self.values.clear();
        self.values.reserve(particles * entries);
        self.entries.clear();
        self.entries.reserve(entries);
    }

    /// The normalised likelihoods p̂(Aᵢ | B\[k\]) (equation 10), in the order of the distances. Each entry's sum over
    /// the particles is 1.
    pub fn normalized(&self) -> &[f64] {
        &self.values
    }

    /// Computes the normalised likelihoods of the distances (equations 11 and 10).
    #[inline(always)]
    fn normalize(&mut self, distances: &[f64], entries: usize, sigma: f64) {
        let Self {
            values,
            entries: of_entries,
        } = self;
        of_entries.clear();
        of_entries.resize(entries, f64::INFINITY);
        for row in distances.chunks_exact(entries) {
            for (least, &distance) in of_entries.iter_mut().zip(row) {
                *least = if distance < *least { distance } else { *least };
            }
        }
        values.clear();
        let share = 1.0 / sigma;
        for row in distances.chunks_exact(entries) {
            let exponents = row.iter().zip(of_entries.iter());
            values.extend(exponents.map(|(distance, least)| (least - distance) * share));
        }
        exponentials(values);
        let sums = of_entries;
        sums.fill(0.0);
        for row in values.chunks_exact(entries) {
            for (sum, likelihood) in sums.iter_mut().zip(row) {
                *sum += likelihood;
            }
        }
        for row in values.chunks_exact_mut(entries) {
            for (likelihood, sum) in row.iter_mut().zip(sums.iter()) {
                *likelihood /= sum;
            }
        }
    }

    /// Multiplies what `weights` hold by the sum of the likelihoods (equation 9), and scales the products to the sum 1.
    #[inline(always)]
    fn sum_rule(&self, entries: usize, (pinned, pinned_weight): (usize, f64), weights: &mut [f64]) {
        // Entries that all weigh nothing would be no likelihood at all.
        let pinned = if pinned < entries { pinned } else { 0 };
        let mut total = 0.0;
        for (weight, row) in weights.iter_mut().zip(self.values.chunks_exact(entries)) {
            let (first, others) = row.split_at(pinned);
            let first = pinned_weight * first.iter().sum::<f64>();
            *weight *= first + others.iter().sum::<f64>();
            total += *weight;
        }
        if total > 0.0 {
            weights.iter_mut().for_each(|weight| *weight /= total);
        } else {
            // Every product underflowed: nothing is known to be better.
            let equal = 1.0 / weights.len() as f64;
            weights.fill(equal);
        }
    }
}

fn exponentials(values: &mut [f64]) {
    values.iter_mut().for_each(|value| *value = value.exp());
}

/// The particle with the greatest weight (equation 12), the first of equals.
pub fn arg_max(weights: &[f64]) -> usize {
    let mut best = 0;
    for (index, weight) in weights.iter().enumerate() {
        if *weight > weights[best] {
            best = index;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn weigh(distances: &[f64], pinned: (usize, f64), exponents: &[f64]) -> Vec<f64> {
        let mut weights = exponents.to_vec();
        let mut likelihoods = Likelihoods::default();
        sum_rule_weights(&mut likelihoods, distances, 0.01, pinned, &mut weights);
        weights
    }

    #[test]
    fn weights_are_those_of_the_printed_equations_times_an_exponential() {
        let (particles, entries) = (23, 3);
        let distance = |i: usize, k: usize| 0.2 + ((3 * i + k).pow(2) % 37) as f64 * 0.003;
        let distances: Vec<f64> = (0..particles * entries)
            .map(|at| distance(at / entries, at % entries))
            .collect();
        let exponents: Vec<f64> = (0..particles).map(|i| -0.1 * (i % 5) as f64).collect();
        for pinned in [(0, 1.0), (1, 3.0), (3, 0.0), (1, 0.0)] {
            let expected: Vec<f64> = (0..particles)
                .map(|i| {
                    let likelihood = |k| {
                        let plain = |i| f64::exp(-distance(i, k) / 0.01);
                        let weight = if k < pinned.0 && pinned.0 < entries {
                            pinned.1
                        } else {
                            1.0
                        };
                        weight * plain(i) / (0..particles).map(plain).sum::<f64>()
                    };
                    exponents[i].exp() * (0..entries).map(likelihood).sum::<f64>()
                })
                .collect();
            let total: f64 = expected.iter().sum();
            let found = weigh(&distances, pinned, &exponents);
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected / total).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn equal_distances_give_equal_weights() {
        let weights = weigh(&[0.3; 12], (0, 1.0), &[0.0; 4]);
        assert!(weights.iter().all(|weight| (weight - 0.25).abs() < 1e-15));
        assert_eq!(arg_max(&weights), 0);
    }

    #[test]
    fn exponents_that_all_underflow_give_equal_weights() {
        assert_eq!(weigh(&[0.1, 0.2], (0, 1.0), &[-900.0; 2]), [0.5; 2]);
    }

    /// The foreground of areas much larger than the last answer gave these: all weights were NaN.
    #[test]
    fn exponents_that_overflow_count_by_their_differences() {
        let weights = weigh(&[0.1; 3], (0, 1.0), &[3000.0, 2999.0, -9.0]);
        assert!(
            (weights[0] / weights[1] - f64::exp(1.0)).abs() < 1e-9,
            "{weights:?}"
        );
        assert!(
            (weights.iter().sum::<f64>() - 1.0).abs() < 1e-15,
            "{weights:?}"
        );
    }

    #[test]
    fn a_common_offset_changes_nothing_even_where_exp_underflows() {
        let near = [0.01, 0.02, 0.015, 0.05];
        let far = near.map(|distance| distance + 50.0);
        let (near, far) = (
            weigh(&near, (0, 1.0), &[0.0; 4]),
            weigh(&far, (0, 1.0), &[0.0; 4]),
        );
        for (near, far) in near.iter().zip(&far) {
            assert!((near - far).abs() < 1e-11);
        }
        assert_eq!(arg_max(&far), 0);
    }
}
