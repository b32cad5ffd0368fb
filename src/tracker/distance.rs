//! (D) The distance of two affine subspaces (equations 4 to 8), from inner products.
//!
//! Where two bases differ in their number of columns, the smaller number is the n of equation 8; bases without any
//! column have the Grassmann distance 0, so that the origins decide.

use std::f64::consts::PI;

use super::Params;
use super::angle::squared_angles;
use super::candidate::CandidateBases;
use super::eigen::{self, LANES, Lanes};
use super::products::Products;

/// The distances of all candidates to all entries of the bag.
#[derive(Debug, Clone, Default)]
pub(super) struct Distances {
    alpha: f64,
    /// γ (equation 5).
    gamma: f64,
    /// n.
    limit: usize,
    /// For each candidate, its distance to each entry.
    values: Vec<f64>,
    /// UᵀF of one candidate with each entry: for each column of U and of F a value for each entry.
    product: Vec<f64>,
    /// The same of [`LANES`] candidates: for each column of U and of F a value for each pair of candidate and entry.
    pairs: Vec<f64>,
    /// For each such pair the smaller number of basis vectors.
    dims: Vec<usize>,
    squares: Vec<Lanes>,
}

impl Distances {
    /// Makes room for these parameters.
    pub fn prepare(&mut self, params: &Params) {
        self.limit = params.basis_dim as usize;
        self.alpha = params.alpha;
        self.gamma = params.gamma();
        self.squares.resize(self.limit * self.limit, [0.0; LANES]);
    }

    /// Computes dist(Aᵢ, B\[k\]) (equation 4) of every candidate i and entry k. `entries` gives ‖μₖ‖² and the number of
    /// basis vectors of each entry.
    #[inline(always)]
    pub fn compute(
        &mut self,
        products: &Products,
        bases: &CandidateBases,
        candidates: usize,
        entries: &[(f64, usize)],
    ) {
        let count = entries.len();
        self.values.clear();
        self.values.resize(candidates * count, 0.0);
        self.product.resize(self.limit * self.limit * count, 0.0);
        self.pairs
            .resize(self.limit * self.limit * count * LANES, 0.0);
        for first in (0..candidates).step_by(LANES) {
            let group = LANES.min(candidates - first);
            self.dims.clear();
            for candidate in first..first + group {
                self.origins(products, candidate, entries);
                if self.alpha < 1.0 {
                    self.bases(products, bases, candidate, entries);
                }
            }
            for at in (0..self.dims.len()).step_by(LANES) {
                self.angles(count, first * count, at);
            }
        }
    }

    /// α γ ‖μᵢ - μₖ‖² (equations 4 and 5) of one candidate.
    #[inline(always)]
    fn origins(&mut self, products: &Products, candidate: usize, entries: &[(f64, usize)]) {
        let count = products.history_len() as f64 + 1.0;
        let row = products.of_candidate(candidate);
        let sum = products.of_sum();
        let norm =
            (products.norm(candidate) + 2.0 * row.with_sum + products.sum_norm()) / (count * count);
        let values = &mut self.values[candidate * entries.len()..][..entries.len()];
        let with_means = row.with_bag.iter().zip(sum.with_bag);
        for ((value, &(entry_norm, _)), (of_row, of_sum)) in
            values.iter_mut().zip(entries).zip(with_means)
        {
            let product = (of_row + of_sum) / count;
            let squared = (norm - 2.0 * product + entry_norm).max(0.0);
            *value = self.alpha * self.gamma * squared;
        }
    }

    /// UᵀF of one candidate with each entry, put beside those of the other candidates of its group.
    #[inline(always)]
    fn bases(
        &mut self,
        products: &Products,
        bases: &CandidateBases,
        candidate: usize,
        entries: &[(f64, usize)],
    ) {
        let count = entries.len();
        bases.times_bag(products, candidate, count, &mut self.product);
        let at = self.dims.len();
        let columns = self.pairs.chunks_exact_mut(count * LANES);
        for (column, values) in columns.zip(self.product.chunks_exact(count)) {
            column[at..at + count].copy_from_slice(values);
        }
        let dim = bases.dim(candidate);
        let dims = entries.iter().map(|&(_, entry_dim)| dim.min(entry_dim));
        self.dims.extend(dims);
    }

    /// Adds (1 - α) β Σ θ² (equations 4 and 6 to 8), β = 4 / (n π²), of the [`LANES`] pairs from `at` on; `first` is
    /// where the group's values begin. The singular values of M = UᵀF are the square roots of the eigenvalues of M Mᵀ.
    /// Squaring costs no digits that count: θ² changes with cos θ at a rate of at most π.
    #[inline(always)]
    fn angles(&mut self, count: usize, first: usize, at: usize) {
        let limit = self.limit;
        let column = |i: usize, j: usize| -> &Lanes {
            self.pairs[(i * limit + j) * count * LANES + at..]
                .first_chunk()
                .expect("the pairs of a group are whole lanes")
        };
        for i in 0..limit {
            for j in i..limit {
                let mut square = [0.0; LANES];
                for k in 0..limit {
                    let (a, b) = (column(i, k), column(j, k));
                    for lane in 0..LANES {
                        square[lane] += a[lane] * b[lane];
                    }
                }
                self.squares[i * limit + j] = square;
            }
        }
        eigen::diagonalize(&mut self.squares, limit, None);
        let mut sum = [0.0; LANES];
        for j in 0..limit {
            let angles = squared_angles(&self.squares[j * limit + j]);
            for lane in 0..LANES {
                sum[lane] += angles[lane];
            }
        }
        let dims = self.dims[at..].iter().take(LANES).enumerate();
        for ((lane, &dim), value) in dims.zip(&mut self.values[first + at..]) {
            if dim < limit {
                sum[lane] = largest_sum(&self.squares, limit, lane, dim);
            }
            // Without a basis nothing is added.
            let beta = 4.0 / (dim.max(1) as f64 * PI * PI);
            *value += (1.0 - self.alpha) * beta * sum[lane];
        }
    }

    /// The distances, candidate by candidate.
    pub fn values(&self) -> &[f64] {
        &self.values
    }
}

/// Σ θ² of the `dim` largest diagonal elements of one lane: where a basis has fewer columns than n, the rest is rounding.
fn largest_sum(squares: &[Lanes], limit: usize, lane: usize, dim: usize) -> f64 {
    let mut cosines = [0.0; LANES];
    for (j, cosine) in cosines[..limit].iter_mut().enumerate() {
        *cosine = squares[j * limit + j][lane];
    }
    cosines[..limit].sort_unstable_by(|a, b| b.total_cmp(a));
    squared_angles(&cosines)[..dim].iter().sum()
}
