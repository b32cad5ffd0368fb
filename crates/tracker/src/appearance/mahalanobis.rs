//! The background's metric by inner products: ⟨x, y⟩ = xᵀ (I + C / ridge)⁻¹ y, for x and y with the mean subtracted.
//!
//! Whitened vectors are compared by their inner products alone, so the root of the covariance is not needed. With the
//! n centred samples as the rows of S, C = SᵀS / n, and by Woodbury's identity
//!
//! (I + C / ridge)⁻¹ = I - Sᵀ (n ridge I + SSᵀ)⁻¹ S = I - (L⁻¹S)ᵀ (L⁻¹S), LLᵀ = n ridge I + SSᵀ,
//!
//! so that ⟨x, y⟩ = x · y - z · w with the *background coordinates* z = L⁻¹Sx and w = L⁻¹Sy: n numbers a vector. LLᵀ is
//! small, and positive definite whatever the samples are. The difference loses digits where a vector lies in the span
//! of the samples: with a ridge of 1, at most log₁₀ of D.

use crate::linalg::{gemm, vector_ops};

/// The metric of n samples; without samples the plain inner product.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Metric {
    /// n.
    pub count: usize,
    /// L⁻¹, lower triangular, row by row.
    pub inverse: Vec<f32>,
}

/// Buffers for fitting a metric.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    products: Vec<f32>,
    /// Lᵀ, upper triangular, row by row.
    factor: Vec<f64>,
    inverse: Vec<f64>,
}

impl Metric {
    /// Becomes the metric of centred `samples` of length `len`; `ridge` is a multiple of the covariance's mean
    /// eigenvalue.
    #[inline(always)]
    pub fn fit(&mut self, samples: &[f32], len: usize, ridge: f64, scratch: &mut Scratch) {
        let count = samples.len() / len;
        self.count = count;
        scratch.products.resize(count * count, 0.0);
        gemm::inner_products(samples, samples, len, count, &mut scratch.products);
        let trace = (0..count).map(|i| f64::from(scratch.products[i * count + i]));
        let ridge = ridge * trace.sum::<f64>() / len as f64;
        self.inverse.clear();
        self.inverse.resize(count * count, 0.0);
        // Equal samples have no covariance. A ridge this small would overflow as a divisor.
        if ridge.is_nan() || ridge <= 1e-20 {
            return;
        }
        scratch.factor.clear();
        scratch
            .factor
            .extend(scratch.products.iter().map(|&product| f64::from(product)));
        for i in 0..count {
            scratch.factor[i * count + i] += ridge;
        }
        factorize(&mut scratch.factor, count, ridge);
        scratch.inverse.clear();
        scratch.inverse.resize(count * count, 0.0);
        invert(&scratch.factor, count, &mut scratch.inverse);
        for (value, exact) in self.inverse.iter_mut().zip(&scratch.inverse) {
            *value = *exact as f32;
        }
    }

    /// The background coordinates of a vector, n of them, from its inner products with the samples.
    #[inline(always)]
    pub fn background_coordinates_of(&self, products: &[f32], out: &mut [f32]) {
        let rows = self.inverse.chunks_exact(self.count.max(1));
        for (value, row) in out.iter_mut().zip(rows) {
            *value = vector_ops::dot(row, products);
        }
    }
}

/// Cholesky's factorisation of a matrix of `count` rows, of which the upper triangle is read: the upper triangle
/// becomes Lᵀ. Only rounding makes a pivot less than `least`.
#[inline(always)]
fn factorize(matrix: &mut [f64], count: usize, least: f64) {
    for k in 0..count {
        let (done, rest) = matrix.split_at_mut((k + 1) * count);
        let pivot = &mut done[k * count..];
        let scale = 1.0 / pivot[k].max(least).sqrt();
        for value in &mut pivot[k..] {
            *value *= scale;
        }
        // The pivot's own root, exact but for rounding.
        pivot[k] = 1.0 / scale;
        for (i, row) in rest.chunks_exact_mut(count).enumerate() {
            let i = k + 1 + i;
            let factor = pivot[i];
            for (value, of_pivot) in row[i..].iter_mut().zip(&pivot[i..]) {
                *value -= factor * of_pivot;
            }
        }
    }
}

/// L⁻¹ from Lᵀ, both of `count` rows.
#[inline(always)]
fn invert(factor: &[f64], count: usize, inverse: &mut [f64]) {
    for i in 0..count {
        let (done, row) = inverse.split_at_mut(i * count);
        let row = &mut row[..count];
        row[i] = 1.0;
        for (j, of_row) in done.chunks_exact(count).enumerate() {
            let coefficient = factor[j * count + i];
            for (value, of_row) in row[..=j].iter_mut().zip(of_row) {
                *value -= coefficient * of_row;
            }
        }
        let scale = 1.0 / factor[i * count + i];
        row[..=i].iter_mut().for_each(|value| *value *= scale);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    fn vectors(count: usize, len: usize, seed: usize) -> Vec<f32> {
        let number =
            |i: usize| ((i * i * 31 + i * 7919 + seed * 104_729) % 1000) as f32 / 500.0 - 1.0;
        (0..count * len).map(number).collect()
    }

    /// Against the printed whitening: (I + C / ridge)^(-1/2) by an eigendecomposition of C.
    #[test]
    fn inner_products_are_those_of_vectors_whitened_by_the_covariance() {
        for (count, len, ridge) in [(9, 16, 1.0), (30, 24, 0.1), (20, 70, 5.0)] {
            let mut samples = vectors(count, len, 1);
            let columns = DMatrix::from_column_slice(len, count, &samples).cast::<f64>();
            let mean = columns.column_mean();
            for sample in samples.chunks_exact_mut(len) {
                for (value, mean) in sample.iter_mut().zip(mean.iter()) {
                    *value -= *mean as f32;
                }
            }
            let mut metric = Metric::default();
            metric.fit(&samples, len, ridge, &mut Scratch::default());

            let centered = DMatrix::from_fn(len, count, |i, j| columns[(i, j)] - mean[i]);
            let covariance = &centered * centered.transpose() / count as f64;
            let ridge = ridge * covariance.trace() / len as f64;
            let eigen = (covariance / ridge + DMatrix::identity(len, len)).symmetric_eigen();
            let root = eigen.eigenvalues.map(|value| value.powf(-0.5));
            let whitening = &eigen.eigenvectors
                * DMatrix::from_diagonal(&root)
                * eigen.eigenvectors.transpose();

            let given = vectors(2, len, 2);
            let background_coordinates_of = |vector: &[f32]| {
                let mut products = vec![0.0; count];
                gemm::inner_products(vector, &samples, len, count, &mut products);
                let mut background_coordinates_of = vec![0.0; count];
                metric.background_coordinates_of(&products, &mut background_coordinates_of);
                background_coordinates_of
            };
            for (x, y) in [(0, 1), (0, 0), (1, 1)] {
                let (x, y) = (&given[x * len..][..len], &given[y * len..][..len]);
                let found = vector_ops::dot(x, y)
                    - vector_ops::dot(&background_coordinates_of(x), &background_coordinates_of(y));
                let whitened = |x: &[f32]| &whitening * DVector::from_column_slice(x).cast::<f64>();
                let expected = whitened(x).dot(&whitened(y));
                assert!(
                    (expected - f64::from(found)).abs() < 1e-4,
                    "{expected} {found}"
                );
            }
        }
    }

    #[test]
    fn equal_or_tiny_samples_give_no_background_coordinate_that_is_not_finite() {
        for value in [0.0, 1e-30, 1e-12, 1e-6] {
            let samples: Vec<f32> = vectors(9, 16, 3).iter().map(|v| v * value).collect();
            let mut metric = Metric::default();
            metric.fit(&samples, 16, 1.0, &mut Scratch::default());
            let mut products = vec![0.0; 9];
            gemm::inner_products(&vectors(1, 16, 4), &samples, 16, 9, &mut products);
            let mut background_coordinates_of = vec![0.0; 9];
            metric.background_coordinates_of(&products, &mut background_coordinates_of);
            assert!(
                background_coordinates_of
                    .iter()
                    .all(|value| value.is_finite()),
                "{value}"
            );
        }
    }
}
