//! (D) The distances of candidates whose subspace is their own vector alone.
//!
//! Equation 4 with the candidate {x, x / ‖x‖}, ‖x‖ = 1: the origin distance is γ ‖x - μₖ‖², and there is one principal
//! angle, between x and the span of Fₖ, with cos θ = ‖Fₖᵀ x‖. All of it follows from the inner products of the
//! candidates with the rows of the [`BagMatrix`]: one matrix product, and small ones for the background's metric (see
//! [`mahalanobis`](crate::appearance::mahalanobis)).

use std::f64::consts::PI;

use pulp::{Arch, Simd};

use crate::appearance::bag_matrix::BagMatrix;
use crate::appearance::model::Vectors;
use crate::linalg::acos::{LANES, squared_angles};
use crate::linalg::fixed_point::FixedPoint;
use crate::linalg::{combinations, vector_ops};
use crate::params::table::Params;

/// γ (equation 5): one over the greatest squared distance of the origins, two unit vectors.
const GAMMA: f64 = 0.25;
/// Candidates are worked on in groups of this many.
const GROUP: usize = 32;

/// What candidates are compared with, and their products.
#[derive(Debug, Default)]
pub(crate) struct PointDistance {
    pub matrix: BagMatrix,
    /// For each row of the matrix its products with all candidates. Those of the entries' rows are under the metric.
    products: Vec<f32>,
    /// The candidates, and scratch for their products.
    candidates: FixedPoint,
    sums: Vec<i32>,
    /// For each sample a component of all candidates' background coordinates.
    candidate_coordinates: Vec<f32>,
    /// Of each candidate the factor that brings it to unit length, and its squared length then.
    scales: Vec<f32>,
    norms: Vec<f32>,
}

/// Appends the distances of candidates to each entry of the bag (equation 4).
#[pulp::with_simd(distances = Arch::new())]
#[inline(always)]
pub(crate) fn distances_simd<S: Simd>(
    simd: S,
    point_distance: &mut PointDistance,
    candidates: Vectors<'_>,
    params: &Params,
    out: &mut Vec<f64>,
) {
    let count = candidates.squares.len();
    let stride = count.next_multiple_of(GROUP);
    point_distance.multiply(simd, candidates.values, params.feature_len(), stride);
    point_distance.normalize(candidates.squares, stride);
    point_distance.compare(count, stride, params, out);
}

impl PointDistance {
    /// The products of the last `count` candidates with the queries.
    pub fn query_products(&self, count: usize) -> [&[f32]; 2] {
        let stride = count.next_multiple_of(GROUP);
        let rows = self.products.len() / stride;
        [rows - 2, rows - 1].map(|row| &self.products[row * stride..][..count])
    }

    /// Computes all products; those with the entries' vectors are under the metric.
    #[inline(always)]
    fn multiply<S: Simd>(&mut self, simd: S, candidates: &[f32], len: usize, stride: usize) {
        let (samples, products) = (self.matrix.samples, &mut self.products);
        self.candidates.set(candidates, len);
        let (rows, sums) = (&self.matrix.rows, &mut self.sums);
        rows.inner_products(simd, &self.candidates, len, stride, sums, products);
        let (of_samples, rest) = products.split_at_mut(samples * stride);
        let coordinates = &mut self.candidate_coordinates;
        coordinates.resize(samples * stride, 0.0);
        let inverse = &self.matrix.inverse;
        combinations::assign_combinations(simd, coordinates, inverse, of_samples, stride);
        let of_entries = &mut rest[..self.matrix.subspace_rows() * stride];
        let entries = &self.matrix.background_coordinates;
        combinations::combine(simd, of_entries, -1.0, entries, coordinates, stride);
    }

    /// Computes the candidates' lengths under the metric, and the factors that bring them to 1.
    #[inline(always)]
    fn normalize(&mut self, squares: &[f32], stride: usize) {
        self.norms.clear();
        self.norms.extend_from_slice(squares);
        self.norms.resize(stride, 0.0);
        for row in self.candidate_coordinates.chunks_exact(stride) {
            for (norm, component) in self.norms.iter_mut().zip(row) {
                *norm -= component * component;
            }
        }
        self.scales.clear();
        self.scales.resize(stride, 0.0);
        let squares = squares.iter().chain(std::iter::repeat(&0.0));
        for ((norm, scale), square) in self.norms.iter_mut().zip(&mut self.scales).zip(squares) {
            // A candidate whose length is only rounding counts as the background's mean.
            (*norm, *scale) = match *norm > square * vector_ops::MIN_REMAINDER {
                true => (1.0, 1.0 / norm.sqrt()),
                false => (0.0, 0.0),
            };
        }
    }

    /// Distances of `count` candidates to all entries.
    #[inline(always)]
    fn compare(&mut self, count: usize, stride: usize, params: &Params, out: &mut Vec<f64>) {
        let alpha = params.alpha;
        // β = 4 / (n π²) (equation 8) with n = 1.
        let beta = 4.0 / (PI * PI);
        let first = out.len();
        let entries = self.matrix.entries.len();
        out.resize(first + count * entries, 0.0);
        let mut row = self.matrix.samples;
        for (k, &(entry_norm, dim)) in self.matrix.entries.iter().enumerate() {
            let products = &self.products[row * stride..][..(1 + dim) * stride];
            row += 1 + dim;
            for at in (0..count).step_by(LANES) {
                let [mut origins, mut cosines] = [[0.0; LANES]; 2];
                let norms = &self.norms[at..][..LANES];
                let scales = &self.scales[at..][..LANES];
                let of_mean = &products[at..][..LANES];
                for lane in 0..LANES {
                    let product = f64::from(of_mean[lane]) * f64::from(scales[lane]);
                    origins[lane] = f64::from(norms[lane]) + entry_norm - 2.0 * product;
                }
                for of_basis in products[stride..].chunks_exact(stride) {
                    let of_basis = &of_basis[at..][..LANES];
                    for lane in 0..LANES {
                        let product = f64::from(of_basis[lane]) * f64::from(scales[lane]);
                        cosines[lane] += product * product;
                    }
                }
                for lane in 0..LANES {
                    // Without a direction on one side there is no angle, and the origins decide.
                    let norm = f64::from(norms[lane]);
                    let has_angle = dim > 0 && norm > 0.0;
                    cosines[lane] = if has_angle { cosines[lane] / norm } else { 1.0 };
                }
                let angles = squared_angles(&cosines);
                let values = out[first + at * entries + k..].iter_mut().step_by(entries);
                for (lane, value) in values.enumerate().take(LANES.min(count - at)) {
                    let origin = origins[lane].max(0.0);
                    *value = alpha * GAMMA * origin + (1.0 - alpha) * beta * angles[lane];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::appearance::background::{self, Background};
    use crate::appearance::bag::Bag;
    use crate::appearance::bag_matrix;
    use crate::appearance::span::{self, Span};
    use crate::features::quantized::QuantizedVector;
    use crate::params::presets::Preset;
    use crate::params::table::Features;
    use nalgebra::{DMatrix, DVector};

    fn vectors(count: usize, seed: usize) -> Vec<f32> {
        let number =
            |i: usize| ((i * i * 31 + i * 7919 + seed * 104_729) % 1000) as f32 / 1000.0 + 0.2;
        (0..count * 20).map(number).collect()
    }

    fn columns(vectors: &[f32]) -> DMatrix<f64> {
        DMatrix::from_column_slice(20, vectors.len() / 20, vectors).cast()
    }

    /// What becomes of vectors that are quantised to 4 bits a value.
    fn kept(vectors: &[f32]) -> DMatrix<f64> {
        let mut out = vec![0.0; vectors.len()];
        for (vector, out) in vectors.chunks(20).zip(out.chunks_mut(20)) {
            let mut quantized = QuantizedVector::default();
            quantized.set(vector);
            quantized.add_to(out, 1.0);
        }
        columns(&out)
    }

    /// Against the printed equations with one column, on vectors whitened by an eigendecomposition of the covariance.
    #[test]
    #[expect(
        clippy::too_many_lines,
        reason = "the equations of the paper, in their order"
    )]
    fn distances_are_those_of_the_printed_equations_with_one_column() {
        for background_samples in [0, 9, 30] {
            let params = Params {
                patch_width: 4,
                patch_height: 5,
                features: Features::Gray,
                background_samples,
                alpha: 0.3,
                ..Preset::Robust.params()
            };
            let samples = vectors(background_samples as usize, 1);
            let mut background = Background::default();
            background.rebuild(&samples, &params, &mut background::Scratch::default());
            let templates = [vectors(5, 2), vectors(4, 3)];
            let (mut bag, mut scratch) = (Bag::default(), span::Scratch::default());
            for templates in &templates {
                span::load(&mut scratch, &background);
                bag.admit(&params, |entry: &mut Span| {
                    entry.fit(templates, &background, &params, &mut scratch);
                });
            }
            let mut candidates = vectors(3, 4);
            let given = columns(&candidates);
            for candidate in candidates.chunks_exact_mut(20) {
                vector_ops::add(candidate, -1.0, &background.mean);
            }
            let squares = candidates.chunks(20).map(|c| vector_ops::dot(c, c));
            let squares: Vec<f32> = squares.collect();
            let mut point_distance = PointDistance::default();
            let query_products = [vectors(1, 5), vectors(1, 6)];
            let queries = [&query_products[0][..], &query_products[1]];
            bag_matrix::load(
                &mut point_distance.matrix,
                &bag,
                &background,
                queries,
                params.feature_len(),
            );
            let mut found = vec![7.0];
            distances(
                &mut point_distance,
                Vectors {
                    values: &candidates,
                    squares: &squares,
                },
                &params,
                &mut found,
            );
            for (query_products, found) in
                query_products.iter().zip(point_distance.query_products(3))
            {
                let expected = columns(&candidates).transpose() * columns(query_products);
                assert!((expected[2] - f64::from(found[2])).abs() < 1e-3);
            }

            let mean = match background_samples {
                0 => DVector::zeros(20),
                _ => kept(&samples).column_mean(),
            };
            let centered = |mut vectors: DMatrix<f64>| {
                let columns = vectors.column_iter_mut();
                columns.for_each(|mut column| column -= &mean);
                vectors
            };
            let mut whitening = DMatrix::identity(20, 20);
            if background_samples > 0 {
                let samples = centered(kept(&samples));
                let covariance = &samples * samples.transpose() / f64::from(background_samples);
                let ridge = covariance.trace() / 20.0;
                let eigen = (covariance / ridge + DMatrix::identity(20, 20)).symmetric_eigen();
                let root = eigen.eigenvalues.map(|value| value.powf(-0.5));
                whitening = &eigen.eigenvectors
                    * DMatrix::from_diagonal(&root)
                    * eigen.eigenvectors.transpose();
            }
            let compared = |vectors: DMatrix<f64>| {
                let mut whitened = &whitening * centered(vectors);
                whitened.column_iter_mut().for_each(|mut column| {
                    column.normalize_mut();
                });
                whitened
            };
            let candidates = compared(given);
            for (i, candidate) in candidates.column_iter().enumerate() {
                for (k, templates) in templates.iter().enumerate() {
                    let v = compared(kept(templates));
                    let origin = (candidate - &v.column_mean()).norm_squared() * GAMMA;
                    let svd = v.svd(true, false);
                    let u = svd.u.expect("it was asked for");
                    let basis = u.columns(0, 3);
                    let cosine = (basis.transpose() * candidate).norm() / candidate.norm();
                    let geodesic = 4.0 / (PI * PI) * cosine.min(1.0).acos().powi(2);
                    let expected = 0.3 * origin + 0.7 * geodesic;
                    let found = found[1 + i * 2 + k];
                    assert!((expected - found).abs() < 1e-4, "{expected} {found}");
                }
            }
        }
    }
}
