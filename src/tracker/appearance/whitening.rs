//! Vectors whitened by the background, one by one: what is compared where a candidate's subspace has several columns.
//!
//! x̂ = M (x - mean) with M = (I + C / ridge)^(-1/2). C has the rank of its few samples, so M = I - B diag(g) Bᵀ with
//! the principal directions B of the samples and g = 1 - (1 + eigenvalue / ridge)^(-1/2). Where all that is wanted are
//! inner products of x̂, [`metric`](crate::tracker::appearance::mahalanobis) has them without B.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::tracker::linalg::combinations;
use crate::tracker::linalg::gemm;
use crate::tracker::linalg::vector_ops;

/// An eigenvalue below this share of the largest is rounding.
const RANK_TOLERANCE: f64 = 1e-5;

/// A transformation of feature vectors; the identity where there is no background.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Whitening {
    mean: Vec<f32>,
    /// B, one direction after the other.
    directions: Vec<f32>,
    /// g of each direction.
    gains: Vec<f32>,
}

impl Whitening {
    /// The whitening by `samples` of this mean, which is taken off already; `ridge` is a multiple of the covariance's
    /// mean eigenvalue.
    pub fn of(mean: &[f32], samples: &[f32], ridge: f64) -> Self {
        let len = mean.len();
        let count = samples.len() / len;
        let mut gram = vec![0.0; count * count];
        gemm::inner_products(samples, samples, len, count, &mut gram);
        let gram = DMatrix::from_fn(count, count, |i, j| f64::from(gram[i * count + j]));
        let ridge = ridge * gram.trace() / count as f64 / len as f64;
        let eigen = SymmetricEigen::new(gram);
        let largest = eigen.eigenvalues.max();
        let mut whitening = Self {
            mean: mean.to_vec(),
            ..Self::default()
        };
        if largest.is_nan() || largest <= 0.0 {
            return whitening;
        }
        let mut coefficients = Vec::new();
        for (index, &value) in eigen.eigenvalues.iter().enumerate() {
            if value > largest * RANK_TOLERANCE {
                let scale = 1.0 / value.sqrt();
                let column = eigen.eigenvectors.column(index);
                coefficients.extend(column.iter().map(|weight| (weight * scale) as f32));
                let gain = 1.0 - (1.0 + value / count as f64 / ridge).powf(-0.5);
                whitening.gains.push(gain as f32);
            }
        }
        whitening.directions = vec![0.0; whitening.gains.len() * len];
        combinations::add_combinations(&mut whitening.directions, 1.0, &coefficients, samples, len);
        whitening
    }

    /// Turns feature vectors, of length `len` one after the other, into what is compared. `scratch` is for intermediate
    /// results.
    pub fn apply(
        &self,
        vectors: &mut [f32],
        len: usize,
        unit_length: bool,
        scratch: &mut Vec<f32>,
    ) {
        if !self.mean.is_empty() {
            for vector in vectors.chunks_exact_mut(len) {
                vector_ops::add(vector, -1.0, &self.mean);
            }
            let count = self.gains.len();
            scratch.clear();
            scratch.resize(vectors.len() / len * count, 0.0);
            gemm::inner_products(vectors, &self.directions, len, count, scratch);
            for row in scratch.chunks_exact_mut(count.max(1)) {
                for (product, gain) in row.iter_mut().zip(&self.gains) {
                    *product *= gain;
                }
            }
            combinations::add_combinations(vectors, -1.0, scratch, &self.directions, len);
        }
        if unit_length {
            vectors
                .chunks_exact_mut(len)
                .for_each(vector_ops::normalize);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_samples_nothing_changes_but_the_length() {
        let given: Vec<f32> = (0..32).map(|i| (i * 37 % 11) as f32 - 4.0).collect();
        let mut found = given.clone();
        Whitening::default().apply(&mut found, 16, false, &mut Vec::new());
        assert_eq!(found, given);
        Whitening::default().apply(&mut found, 16, true, &mut Vec::new());
        let length: f32 = found[..16].iter().map(|value| value * value).sum();
        assert!((length - 1.0).abs() < 1e-5);
    }

    #[test]
    fn equal_samples_make_a_finite_whitening() {
        let whitening = Whitening::of(&[0.25; 16], &[0.0; 9 * 16], 1.0);
        let mut found: Vec<f32> = (0..32).map(|i| (i * 37 % 11) as f32 - 4.0).collect();
        whitening.apply(&mut found, 16, true, &mut Vec::new());
        assert!(found.iter().all(|value| value.is_finite()));
    }
}
