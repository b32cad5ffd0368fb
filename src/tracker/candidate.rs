//! (B) The affine subspaces of all candidates, in the coordinates of the shared history.
//!
//! V = [v, H] (equation 2). With the orthonormal Q of [`products`](super::products), q = Qᵀv, and e the unit vector
//! of the rest v - Qq, whose length is ρ, V Vᵀ is diag(Λ, 0) + z zᵀ in the basis [Q, e], where z = (q, ρ). So the
//! left singular vectors of V are [Q, e] times the eigenvectors of a matrix of P + 1 rows. Since e = (v - Qq) / ρ they
//! are as well combinations of Q and v, so Uᵀf for any f follows from Qᵀf and vᵀf.
//!
//! Dividing by ρ is harmless however small it is: the coordinate of a counting direction along e is ρ times a bounded
//! number (the z of an eigenvector over its eigenvalue).

use super::Params;
use super::eigen::{self, LANES, Lanes};
use super::products::Products;
use super::subspace;

/// A rest shorter than this share of the candidate (squared) is rounding.
const NO_REST: f64 = 1e-13;

/// The bases of all candidates of a frame.
#[derive(Debug, Clone, Default)]
pub(super) struct CandidateBases {
    /// n.
    limit: usize,
    /// P + 1.
    size: usize,
    /// For each candidate n columns of P + 1 coefficients, of Q and of v.
    coefficients: Vec<f64>,
    /// For each candidate the number of columns that count.
    dims: Vec<usize>,
    /// For each candidate ρ, or 0 if v is in the span of the history.
    rests: Vec<f64>,
    matrix: Vec<Lanes>,
    vectors: Vec<Lanes>,
}

impl CandidateBases {
    /// Makes room for these parameters.
    pub fn prepare(&mut self, params: &Params) {
        (self.limit, self.size) = (params.basis_dim as usize, params.history as usize + 1);
        let count = params.particles as usize;
        self.coefficients
            .resize(count * self.limit * self.size, 0.0);
        self.dims.resize(count, 0);
        self.rests.resize(count, 0.0);
        self.matrix.resize(self.size * self.size, [0.0; LANES]);
        self.vectors.resize(self.size * self.size, [0.0; LANES]);
    }

    /// Finds the basis of every candidate.
    #[inline(always)]
    pub fn compute(&mut self, products: &Products) {
        let count = self.dims.len();
        for first in (0..count).step_by(LANES) {
            let lanes = LANES.min(count - first);
            self.matrix.fill([0.0; LANES]);
            for lane in 0..lanes {
                self.fill(products, first + lane, lane);
            }
            eigen::diagonalize(&mut self.matrix, self.size, Some(&mut self.vectors));
            for lane in 0..lanes {
                self.take(products, first + lane, lane);
            }
        }
    }

    /// diag(Λ, 0) + z zᵀ of one candidate, upper triangle.
    #[inline(always)]
    fn fill(&mut self, products: &Products, candidate: usize, lane: usize) {
        let row = products.of_candidate(candidate);
        let norm = products.norm(candidate);
        let inside: f64 = row.with_directions.iter().map(|q| q * q).sum();
        let rest = norm - inside;
        let rest = if rest > norm * NO_REST {
            rest.sqrt()
        } else {
            0.0
        };
        self.rests[candidate] = rest;
        let last = self.size - 1;
        for i in 0..last {
            let q = row.with_directions[i];
            for j in i..last {
                self.matrix[i * self.size + j][lane] = q * row.with_directions[j];
            }
            self.matrix[i * self.size + i][lane] += products.history_eigenvalues()[i];
            self.matrix[i * self.size + last][lane] = q * rest;
        }
        self.matrix[last * self.size + last][lane] = rest * rest;
    }

    /// The n dominant eigenvectors of one candidate.
    #[inline(always)]
    fn take(&mut self, products: &Products, candidate: usize, lane: usize) {
        let size = self.size;
        let value = |j: usize| self.matrix[j * size + j][lane];
        let mut order = [0_usize; 16];
        let order = &mut order[..size];
        for (position, slot) in order.iter_mut().enumerate() {
            *slot = position;
        }
        order.sort_unstable_by(|&a, &b| value(b).total_cmp(&value(a)));
        let dim = subspace::dominant(order.iter().map(|&j| value(j)), self.limit);
        self.dims[candidate] = dim;
        let block = &mut self.coefficients[candidate * self.limit * size..][..self.limit * size];
        block.fill(0.0);
        let directions = products.of_candidate(candidate).with_directions;
        for (column, &j) in block.chunks_exact_mut(size).zip(&order[..dim]) {
            let coordinate = |r: usize| self.vectors[j * size + r][lane];
            let of_candidate = if self.rests[candidate] > 0.0 {
                coordinate(size - 1) / self.rests[candidate]
            } else {
                0.0
            };
            for (slot, &q) in directions.iter().enumerate() {
                column[slot] = coordinate(slot) - of_candidate * q;
            }
            column[size - 1] = of_candidate;
        }
    }

    /// The number of basis vectors of a candidate.
    #[inline(always)]
    pub fn dim(&self, candidate: usize) -> usize {
        self.dims[candidate]
    }

    /// UᵀF of a candidate with the bases of a bag of `count` entries, into `out`: for each of the n columns of U (zero
    /// beyond its dimension) and each of F a value for each entry.
    #[inline(always)]
    pub fn times_bag(&self, products: &Products, candidate: usize, count: usize, out: &mut [f64]) {
        // The first values are those of the means.
        let bases = count..count * (self.limit + 1);
        let of_candidate = &products.of_candidate(candidate).with_bag[bases.clone()];
        let slots = self.size - 1;
        out.fill(0.0);
        let block = &self.coefficients[candidate * self.limit * self.size..];
        let columns = block.chunks_exact(self.size);
        for (target, column) in out.chunks_exact_mut(count * self.limit).zip(columns) {
            for (slot, &coefficient) in column[..slots].iter().enumerate() {
                let of_direction = &products.of_direction(slot).with_bag[bases.clone()];
                add(target, of_direction, coefficient);
            }
            add(target, of_candidate, column[slots]);
        }
    }
}

/// `sum += weight * values`.
#[inline(always)]
fn add(sum: &mut [f64], values: &[f64], weight: f64) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += weight * value;
    }
}
