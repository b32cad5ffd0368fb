//! (D) The distance where a candidate's subspace is its own vector alone.
//!
//! Equation 4 with the candidate {x, x / ‖x‖}: the origin distance is γ ‖x - μₖ‖², and there is one principal angle,
//! between x and the span of Fₖ, with cos θ = ‖Fₖᵀ x‖ / ‖x‖. All of it comes from the inner products of the candidates
//! with the means and the basis vectors of the bag, and under the background's metric (see [`metric`](crate::tracker::appearance::mahalanobis))
//! with its samples: one matrix product, and small ones for the shadows. What the discriminant asks of the candidates
//! is in the same product.

use std::f64::consts::PI;

use pulp::{Arch, Simd, WithSimd};

use crate::tracker::appearance::span::MIN_REMAINDER;
use crate::tracker::linalg::acos::{LANES, squared_angles};
use crate::tracker::linalg::combinations;
use crate::tracker::linalg::gemm;
use crate::tracker::params::table::Params;
use crate::tracker::state::State;

/// Candidates are worked on in groups of this many.
const GROUP: usize = 32;

/// What candidates are multiplied with, and the products.
#[derive(Debug, Default)]
pub(crate) struct PointDistance {
    /// The samples; for each entry of the bag its mean, then its basis vectors; what the discriminant asks for.
    vectors: Vec<f32>,
    /// The looks of an entry.
    templates: Vec<f32>,
    /// The number of samples, and L⁻¹ of the metric.
    samples: usize,
    inverse: Vec<f32>,
    /// ‖μₖ‖² and the number of basis vectors of each entry.
    entries: Vec<(f64, usize)>,
    /// For each mean and basis vector its shadow.
    background_coordinates: Vec<f32>,
    /// For each of `vectors` its products with all candidates; then, for the entries, under the metric.
    products: Vec<f32>,
    /// For each sample a component of all candidates' shadows.
    candidate_coordinates: Vec<f32>,
    /// Of each candidate the factor that brings it to its length, and the squared length it has then.
    scales: Vec<f32>,
    norms: Vec<f32>,
}

/// [`PointDistance::set_state`], to be compiled for the instructions that this machine has.
struct SetState<'a> {
    point_distance: &'a mut PointDistance,
    state: &'a State,
    query_products: [&'a [f32]; 2],
}

impl WithSimd for SetState<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.point_distance
            .set_all(simd, self.state, self.query_products);
    }
}

/// [`PointDistance::distances`], to be compiled for the instructions that this machine has.
struct Distances<'a> {
    point_distance: &'a mut PointDistance,
    candidates: &'a [f32],
    squares: &'a [f32],
    params: &'a Params,
    out: &'a mut Vec<f64>,
}

impl WithSimd for Distances<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let stride = self.squares.len().next_multiple_of(GROUP);
        let len = self.params.feature_len();
        self.point_distance
            .multiply(simd, self.candidates, len, stride);
        self.point_distance
            .measure(self.squares, stride, self.params);
        self.point_distance
            .compare(self.squares.len(), stride, self.params, self.out);
    }
}

impl PointDistance {
    /// Takes the bag and the metric of `state`, and two vectors whose products are asked for as well.
    pub fn set_state(&mut self, state: &State, query_products: [&[f32]; 2]) {
        Arch::new().dispatch(SetState {
            point_distance: self,
            state,
            query_products,
        });
    }

    #[inline(always)]
    fn set_all<S: Simd>(&mut self, simd: S, state: &State, query_products: [&[f32]; 2]) {
        let background = &state.background;
        let len = state.params.feature_len();
        self.samples = background.metric().count();
        self.inverse.clear();
        self.inverse
            .extend_from_slice(background.metric().inverse());
        self.entries.clear();
        let entries = state.bag.entries();
        self.entries
            .extend(entries.iter().map(|entry| entry.combination().0.size()));
        let count = self.samples + self.templates() + query_products.len();
        self.vectors.resize(count * len, 0.0);
        let (samples, mut rest) = self.vectors.split_at_mut(self.samples * len);
        background.write_samples(samples);
        self.background_coordinates.clear();
        for (entry, (_, dim)) in entries.iter().zip(&self.entries) {
            let (combination, templates) = entry.combination();
            let (vectors, others) = rest.split_at_mut((1 + dim) * len);
            combination.write_to(simd, templates, background, &mut self.templates, vectors);
            self.background_coordinates
                .extend_from_slice(combination.background_coordinates());
            rest = others;
        }
        for (vector, query_products) in rest.chunks_exact_mut(len).zip(query_products) {
            vector[..query_products.len()].copy_from_slice(query_products);
        }
    }

    /// Appends the distances of candidates (vectors of length D, with the background's mean taken off, one after the
    /// other, and their squared lengths) to each entry (equation 4).
    pub fn distances(
        &mut self,
        candidates: &[f32],
        squares: &[f32],
        params: &Params,
        out: &mut Vec<f64>,
    ) {
        Arch::new().dispatch(Distances {
            point_distance: self,
            candidates,
            squares,
            params,
            out,
        });
    }

    /// The products of the last candidates with the vectors that were asked for.
    pub fn query_products(&self, count: usize) -> [&[f32]; 2] {
        let stride = count.next_multiple_of(GROUP);
        let rows = self.products.len() / stride;
        [rows - 2, rows - 1].map(|row| &self.products[row * stride..][..count])
    }

    /// The number of means and basis vectors.
    #[inline(always)]
    fn templates(&self) -> usize {
        self.entries.iter().map(|(_, dim)| 1 + dim).sum()
    }

    /// All products, those with the entries' vectors under the metric.
    #[inline(always)]
    fn multiply<S: Simd>(&mut self, simd: S, candidates: &[f32], len: usize, stride: usize) {
        let (samples, templates) = (self.samples, self.templates());
        // What is in the places between the products is of no account.
        let products = &mut self.products;
        products.resize(self.vectors.len() / len * stride, 0.0);
        gemm::multiply(simd, &self.vectors, candidates, len, stride, products);
        let (of_samples, rest) = products.split_at_mut(samples * stride);
        let background_coordinates = &mut self.candidate_coordinates;
        background_coordinates.resize(samples * stride, 0.0);
        combinations::assign_triangular(
            simd,
            background_coordinates,
            &self.inverse,
            of_samples,
            stride,
        );
        let of_templates = &mut rest[..templates * stride];
        combinations::combine(
            simd,
            of_templates,
            -1.0,
            &self.background_coordinates,
            background_coordinates,
            stride,
        );
    }

    /// Lengths under the metric, from those without.
    #[inline(always)]
    fn measure(&mut self, squares: &[f32], stride: usize, params: &Params) {
        self.norms.clear();
        self.norms.extend_from_slice(squares);
        self.norms.resize(stride, 0.0);
        for row in self.candidate_coordinates.chunks_exact(stride) {
            for (norm, component) in self.norms.iter_mut().zip(row) {
                *norm -= component * component;
            }
        }
        self.scales.clear();
        self.scales.resize(stride, 1.0);
        let squares = squares.iter().chain(std::iter::repeat(&0.0));
        for ((norm, scale), square) in self.norms.iter_mut().zip(&mut self.scales).zip(squares) {
            let is_left = *norm > square * MIN_REMAINDER;
            if !is_left {
                // Nothing but rounding: as if it were the mean background.
                (*norm, *scale) = (0.0, 0.0);
            } else if params.unit_length {
                (*norm, *scale) = (1.0, 1.0 / norm.sqrt());
            }
        }
    }

    /// Distances of `count` candidates to all entries.
    #[inline(always)]
    fn compare(&mut self, count: usize, stride: usize, params: &Params, out: &mut Vec<f64>) {
        let (alpha, gamma) = (params.alpha, params.gamma());
        // β = 4 / (n π²) (equation 8) with n = 1.
        let beta = 4.0 / (PI * PI);
        let first = out.len();
        let entries = self.entries.len();
        out.resize(first + count * entries, 0.0);
        let mut row = self.samples;
        for (k, &(entry_norm, dim)) in self.entries.iter().enumerate() {
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
                    *value = alpha * gamma * origin + (1.0 - alpha) * beta * angles[lane];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::appearance::background;
    use crate::tracker::appearance::bag;
    use crate::tracker::image::frame::GrayFrame;
    use crate::tracker::image::rect::Rect;
    use crate::tracker::linalg::vector_ops;
    use crate::tracker::params::presets::Preset;
    use crate::tracker::params::table::Features;
    use crate::tracker::tracker::Tracker;
    use nalgebra::{DMatrix, DVector};

    fn vectors(count: usize, seed: usize) -> Vec<f32> {
        let number =
            |i: usize| ((i * i * 31 + i * 7919 + seed * 104_729) % 1000) as f32 / 1000.0 + 0.2;
        (0..count * 20).map(number).collect()
    }

    fn columns(vectors: &[f32]) -> DMatrix<f64> {
        DMatrix::from_column_slice(20, vectors.len() / 20, vectors).cast()
    }

    /// What becomes of vectors that are kept in a byte a value.
    fn kept(vectors: &[f32]) -> DMatrix<f64> {
        let mut out = vec![0.0; vectors.len()];
        for (vector, out) in vectors.chunks(20).zip(out.chunks_mut(20)) {
            let mut look = crate::tracker::features::quantized::QuantizedVector::default();
            look.keep(vector);
            look.add_to(out, 1.0);
        }
        columns(&out)
    }

    /// Against the printed equations with one column, on vectors whitened by an eigendecomposition of the covariance.
    #[test]
    fn distances_are_those_of_the_printed_equations_with_one_column() {
        for (background_samples, unit_length) in
            [(0, true), (0, false), (9, true), (9, false), (30, true)]
        {
            let params = Params {
                patch_width: 4,
                patch_height: 5,
                features: Features::Gray,
                background_samples,
                unit_length,
                alpha: 0.3,
                ..Preset::Robust.params()
            };
            let frame =
                GrayFrame::from_luma(40, 30, (0..1200).map(|i| (i * 7 % 251) as u8).collect());
            let frame = frame.expect("a frame of this size");
            let target = Rect::new(10.0, 8.0, 12.0, 10.0);
            let mut state = Tracker::new(&frame, target, params.clone())
                .expect("a box inside")
                .state;

            let samples = vectors(background_samples as usize, 1);
            state.background = background::Background::default();
            state
                .background
                .rebuild(&samples, &params, &mut background::Scratch::default());
            let templates = [vectors(5, 2), vectors(4, 3)];
            state.bag = bag::Bag::default();
            let mut scratch = bag::Scratch::default();
            for templates in &templates {
                state
                    .bag
                    .admit(templates, &state.background, &params, &mut scratch);
            }
            let mut candidates = vectors(3, 4);
            let given = columns(&candidates);
            for candidate in candidates.chunks_exact_mut(20) {
                vector_ops::add(candidate, -1.0, state.background.mean());
            }
            let squares: Vec<f32> = candidates
                .chunks(20)
                .map(|c| vector_ops::dot(c, c))
                .collect();
            let mut point_distance = PointDistance::default();
            let query_products = [vectors(1, 5), vectors(1, 6)];
            point_distance.set_state(&state, [&query_products[0], &query_products[1]]);
            let mut found = vec![7.0];
            point_distance.distances(&candidates, &squares, &params, &mut found);
            for (query_products, found) in
                query_products.iter().zip(point_distance.query_products(3))
            {
                let expected = columns(&candidates).transpose() * columns(query_products);
                assert!((expected[2] - f64::from(found[2])).abs() < 1e-4);
            }

            let mean = match background_samples {
                0 => DVector::zeros(20),
                _ => kept(&samples).column_mean(),
            };
            let centered = |mut vectors: DMatrix<f64>| {
                vectors
                    .column_iter_mut()
                    .for_each(|mut column| column -= &mean);
                vectors
            };
            let mut whitening = DMatrix::identity(20, 20);
            if background_samples > 0 {
                let samples = centered(kept(&samples));
                let covariance = &samples * samples.transpose() / f64::from(background_samples);
                let ridge = params.background_ridge * covariance.trace() / 20.0;
                let eigen = (covariance / ridge + DMatrix::identity(20, 20)).symmetric_eigen();
                let root = eigen.eigenvalues.map(|value| value.powf(-0.5));
                whitening = &eigen.eigenvectors
                    * DMatrix::from_diagonal(&root)
                    * eigen.eigenvectors.transpose();
            }
            let compared = |vectors: DMatrix<f64>| {
                let mut whitened = &whitening * centered(vectors);
                if unit_length {
                    whitened.column_iter_mut().for_each(|mut column| {
                        column.normalize_mut();
                    });
                }
                whitened
            };
            let candidates = compared(given);
            for (i, candidate) in candidates.column_iter().enumerate() {
                for (k, templates) in templates.iter().enumerate() {
                    let v = compared(kept(templates));
                    let origin = (candidate - &v.column_mean()).norm_squared() * params.gamma();
                    let svd = v.svd(true, false);
                    let basis = svd
                        .u
                        .expect("query_products for")
                        .columns(0, 3)
                        .into_owned();
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
