//! (D) The distance where a candidate's subspace is its own vector alone.
//!
//! Equation 4 with the candidate {x, x / ‖x‖}: the origin distance is γ ‖x - μₖ‖², and there is one principal angle,
//! between x and the span of Fₖ, with cos θ = ‖Fₖᵀ x‖ / ‖x‖. All of it comes from the inner products of the candidates
//! with the means and the basis vectors of the bag, one matrix product.

use std::f64::consts::PI;

use super::Params;
use super::bag::Bag;
use super::matrix;

/// The bag as a matrix, and the products of candidates with it.
#[derive(Debug, Default)]
pub(super) struct Solitary {
    /// For each entry its mean, then its basis vectors.
    bag: Vec<f32>,
    /// ‖μₖ‖² and the number of basis vectors of each entry.
    entries: Vec<(f64, usize)>,
    products: Vec<f32>,
}

impl Solitary {
    /// Takes the subspaces of a bag.
    pub fn set_bag(&mut self, bag: &Bag, params: &Params) {
        self.bag.clear();
        self.entries.clear();
        for subspace in bag.subspaces() {
            self.bag.extend_from_slice(&subspace.mean);
            self.bag.extend_from_slice(&subspace.basis);
            let norm = matrix::dot(&subspace.mean, &subspace.mean);
            self.entries.push((f64::from(norm), subspace.dim()));
        }
        debug_assert!(self.bag.len().is_multiple_of(params.feature_len()));
    }

    /// Appends the distances of candidates (vectors of length D, one after the other) to each entry (equation 4).
    pub fn distances(&mut self, candidates: &[f32], params: &Params, out: &mut Vec<f64>) {
        let len = params.feature_len();
        matrix::inner_products(candidates, &self.bag, len, &mut self.products);
        let (alpha, gamma) = (params.alpha, params.gamma());
        // β = 4 / (n π²) (equation 8) with n = 1.
        let beta = 4.0 / (PI * PI);
        let width = self.bag.len() / len;
        let rows = self.products.chunks_exact(width);
        for (candidate, row) in candidates.chunks_exact(len).zip(rows) {
            let norm = f64::from(matrix::dot(candidate, candidate));
            let mut at = 0;
            for &(entry_norm, dim) in &self.entries {
                let origin = norm + entry_norm - 2.0 * f64::from(row[at]);
                let inside: f64 = row[at + 1..at + 1 + dim]
                    .iter()
                    .map(|&product| f64::from(product).powi(2))
                    .sum();
                // Without a direction on one side there is no angle, and the origins decide.
                let angle = if dim == 0 || norm <= 0.0 {
                    0.0
                } else {
                    (inside / norm).min(1.0).sqrt().acos()
                };
                out.push(alpha * gamma * origin.max(0.0) + (1.0 - alpha) * beta * angle * angle);
                at += 1 + dim;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::background::Metric;
    use super::super::bag::Entry;
    use super::*;
    use crate::tracker::{Features, Preset};
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn distances_are_those_of_the_printed_equations_with_one_column() {
        let params = Params {
            patch_width: 4,
            patch_height: 5,
            features: Features::Gray,
            background_samples: 0,
            alpha: 0.3,
            ..Preset::Robust.params()
        };
        let number = |i: usize| ((i * i * 31 + i * 7919) % 1000) as f32 / 1000.0;
        let vectors: Vec<f32> = (0..5 * 20).map(number).collect();
        let bag = Bag::new(Entry::new(&vectors, &Metric::default(), &params));
        let mut solitary = Solitary::default();
        solitary.set_bag(&bag, &params);
        let mut candidates: Vec<f32> = (300..300 + 3 * 20).map(number).collect();
        Metric::default().apply(&mut candidates, 20, true, &mut Vec::new());
        let mut found = Vec::new();
        solitary.distances(&candidates, &params, &mut found);

        let unit = |vector: &[f32]| DVector::from_column_slice(vector).cast::<f64>().normalize();
        let columns: Vec<_> = vectors.chunks(20).map(unit).collect();
        let v = DMatrix::from_columns(&columns);
        let mean = v.column_mean();
        let svd = v.svd(true, false);
        let basis = svd.u.expect("asked for").columns(0, 3).into_owned();
        for (candidate, found) in candidates.chunks(20).zip(&found) {
            let candidate = unit(candidate);
            let origin = (&candidate - &mean).norm_squared() / 4.0;
            let cosine = (basis.transpose() * &candidate).norm().min(1.0);
            let geodesic = 4.0 / (PI * PI) * cosine.acos().powi(2);
            let expected = 0.3 * origin + 0.7 * geodesic;
            assert!((expected - found).abs() < 1e-5, "{expected} {found}");
        }
    }
}
