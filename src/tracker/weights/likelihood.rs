//! (D) From distances to the weights of the particles (equations 9 to 12).
//!
//! exp(-dist / σ) underflows for every candidate as soon as the nearest is some hundred σ away, and 0 / 0 is no
//! likelihood. Equation 10 normalises over the candidates, so the least distance to an entry may be taken from all
//! distances to it first: the result is the same, and the largest term is always 1.

use pulp::{Arch, Simd, WithSimd};

use crate::tracker::linalg::exp;

/// Entries whose sums are kept together.
const BLOCK: usize = 16;

/// The normalised likelihoods p̂(Aᵢ | B\[k\]) (equations 10 and 11) of `distances`, which hold for each candidate its
/// distance to each of `entries` entries; the result in the same order. Each entry's sum over the candidates is 1.
pub(crate) fn normalized(distances: &[f64], entries: usize, sigma: f64, out: &mut Vec<f64>) {
    out.clear();
    out.extend_from_slice(distances);
    Arch::new().dispatch(Normalize {
        values: out,
        entries,
        sigma,
    });
}

/// [`normalized`] in place, to be compiled for the instructions that this machine has.
struct Normalize<'a> {
    values: &'a mut [f64],
    entries: usize,
    sigma: f64,
}

impl WithSimd for Normalize<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            values,
            entries,
            sigma,
        } = self;
        for first in (0..entries).step_by(BLOCK) {
            let block = first..entries.min(first + BLOCK);
            let mut least = [f64::INFINITY; BLOCK];
            for row in values.chunks_exact(entries) {
                for (least, &value) in least.iter_mut().zip(&row[block.clone()]) {
                    *least = if value < *least { value } else { *least };
                }
            }
            for row in values.chunks_exact_mut(entries) {
                for (value, least) in row[block.clone()].iter_mut().zip(&least) {
                    *value = (least - *value) / sigma;
                }
            }
        }
        exp::exp(values);
        for first in (0..entries).step_by(BLOCK) {
            let block = first..entries.min(first + BLOCK);
            let mut sums = [0.0; BLOCK];
            for row in values.chunks_exact(entries) {
                for (sum, value) in sums.iter_mut().zip(&row[block.clone()]) {
                    *sum += value;
                }
            }
            for row in values.chunks_exact_mut(entries) {
                for (value, sum) in row[block.clone()].iter_mut().zip(&sums) {
                    *value /= sum;
                }
            }
        }
    }
}

/// The weight of each particle: the sum of its likelihoods over the bag (equation 9), the first `pinned` entries
/// counting `pinned_weight` times, scaled so that the weights sum to 1.
pub(crate) fn sum_rule(
    likelihoods: &[f64],
    entries: usize,
    (pinned, pinned_weight): (usize, f64),
    out: &mut Vec<f64>,
) {
    let pinned = pinned.min(entries);
    // Entries that all weigh nothing would be no likelihood at all.
    let pinned_weight = if pinned == entries {
        1.0
    } else {
        pinned_weight
    };
    let total = pinned_weight * pinned as f64 + (entries - pinned) as f64;
    out.clear();
    out.extend(likelihoods.chunks_exact(entries).map(|row| {
        let (first, others) = row.split_at(pinned);
        let first = pinned_weight * first.iter().sum::<f64>();
        (first + others.iter().sum::<f64>()) / total
    }));
}

/// The particle with the greatest weight (equation 12), the first of equals.
pub(crate) fn arg_max(weights: &[f64]) -> usize {
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

    #[test]
    fn equal_distances_give_equal_weights() {
        let (mut likelihoods, mut weights) = (Vec::new(), Vec::new());
        normalized(&[0.3; 12], 3, 0.01, &mut likelihoods);
        sum_rule(&likelihoods, 3, (0, 1.0), &mut weights);
        assert!(weights.iter().all(|weight| (weight - 0.25).abs() < 1e-15));
        assert_eq!(arg_max(&weights), 0);
    }

    #[test]
    fn a_pinned_entry_counts_as_often_as_it_weighs() {
        let mut weights = Vec::new();
        sum_rule(&[0.9, 0.2, 0.1, 0.8], 2, (1, 3.0), &mut weights);
        assert!((weights[0] - 2.9 / 4.0).abs() < 1e-15);
        assert!((weights[1] - 1.1 / 4.0).abs() < 1e-15);
        sum_rule(&[0.9, 0.1], 1, (1, 0.0), &mut weights);
        assert_eq!(weights, [0.9, 0.1]);
    }

    #[test]
    fn a_common_offset_changes_nothing_even_where_exp_underflows() {
        let near = [0.01, 0.02, 0.015, 0.05];
        let far = near.map(|distance| distance + 50.0);
        let (mut a, mut b) = (Vec::new(), Vec::new());
        normalized(&near, 1, 0.01, &mut a);
        normalized(&far, 1, 0.01, &mut b);
        let plain: Vec<f64> = near
            .iter()
            .map(|distance| (-distance / 0.01).exp())
            .collect();
        let sum: f64 = plain.iter().sum();
        for i in 0..near.len() {
            assert!((a[i] - plain[i] / sum).abs() < 1e-14);
            assert!((a[i] - b[i]).abs() < 1e-11);
        }
        assert_eq!(arg_max(&a), 0);
    }
}
