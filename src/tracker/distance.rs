//! (D) The distance of two affine subspaces (equations 4 to 8), from inner products.
//!
//! Where two bases differ in their number of columns, the smaller number is the n of equation 8; bases without any
//! column have the Grassmann distance 0, so that the origins decide.

use std::f64::consts::PI;

use super::Params;
use super::candidate::CandidateBases;
use super::eigen::{self, LANES, Lanes};
use super::products::Products;

/// The distances of all candidates to all entries of the bag.
#[derive(Debug, Clone)]
pub(super) struct Distances {
    alpha: f64,
    /// γ (equation 5).
    gamma: f64,
    limit: usize,
    /// For each candidate, its distance to each entry.
    values: Vec<f64>,
    pending: Vec<(usize, usize)>,
    squares: Vec<Lanes>,
    product: Vec<f64>,
}

impl Distances {
    pub fn new(params: &Params) -> Self {
        let limit = params.basis_dim as usize;
        Self {
            alpha: params.alpha,
            gamma: params.gamma(),
            limit,
            values: Vec::new(),
            pending: Vec::with_capacity(LANES),
            squares: vec![[0.0; LANES]; limit * limit],
            product: Vec::new(),
        }
    }

    /// Computes dist(Aᵢ, B\[k\]) (equation 4) of every candidate i and entry k. `entries` gives ‖μₖ‖² and the number of
    /// basis vectors of each entry.
    pub fn compute(
        &mut self,
        products: &Products,
        bases: &CandidateBases,
        candidates: usize,
        entries: &[(f64, usize)],
    ) {
        self.values.clear();
        self.values.resize(candidates * entries.len(), 0.0);
        for candidate in 0..candidates {
            let at = candidate * entries.len();
            self.origins(products, candidate, entries, at);
            if self.alpha < 1.0 {
                bases.times_bag(products, candidate, &mut self.product);
                for (k, &(_, entry_dim)) in entries.iter().enumerate() {
                    self.angles(k, at + k, bases.dim(candidate).min(entry_dim));
                }
            }
        }
        self.flush();
    }

    /// α γ ‖μᵢ - μₖ‖² (equations 4 and 5) of one candidate.
    fn origins(
        &mut self,
        products: &Products,
        candidate: usize,
        entries: &[(f64, usize)],
        at: usize,
    ) {
        let count = products.history_len() as f64 + 1.0;
        let row = products.of_candidate(candidate);
        let sum = products.of_sum();
        let norm =
            (products.norm(candidate) + 2.0 * row.with_sum + products.sum_norm()) / (count * count);
        for (k, &(entry_norm, _)) in entries.iter().enumerate() {
            let column = k * (self.limit + 1);
            let product = (row.with_bag[column] + sum.with_bag[column]) / count;
            let squared = (norm - 2.0 * product + entry_norm).max(0.0);
            self.values[at + k] = self.alpha * self.gamma * squared;
        }
    }

    /// Queues the principal angles of one candidate and entry `k`: the singular values of M = UᵀF are the square roots
    /// of the eigenvalues of M Mᵀ. Squaring costs no digits that count: θ² changes with cos θ at a rate of at most π.
    fn angles(&mut self, k: usize, at: usize, dim: usize) {
        if dim == 0 {
            return;
        }
        let lane = self.pending.len();
        let width = self.product.len() / self.limit;
        let first = k * (self.limit + 1) + 1;
        for i in 0..self.limit {
            let a = &self.product[i * width + first..][..self.limit];
            for j in i..self.limit {
                let b = &self.product[j * width + first..][..self.limit];
                let square = a.iter().zip(b).map(|(a, b)| a * b).sum();
                self.squares[i * self.limit + j][lane] = square;
            }
        }
        self.pending.push((at, dim));
        if self.pending.len() == LANES {
            self.flush();
        }
    }

    /// Adds (1 - α) β Σ θ² (equations 4 and 6 to 8) of what is queued, β = 4 / (n π²).
    fn flush(&mut self) {
        eigen::diagonalize(&mut self.squares, self.limit, None);
        for (lane, (at, dim)) in self.pending.drain(..).enumerate() {
            let mut cosines = [0.0; 8];
            let cosines = &mut cosines[..self.limit];
            for (j, cosine) in cosines.iter_mut().enumerate() {
                *cosine = self.squares[j * self.limit + j][lane]
                    .clamp(0.0, 1.0)
                    .sqrt();
            }
            cosines.sort_unstable_by(|a, b| b.total_cmp(a));
            let squared: f64 = cosines[..dim]
                .iter()
                .map(|cosine| cosine.acos().powi(2))
                .sum();
            let beta = 4.0 / (dim as f64 * PI * PI);
            self.values[at] += (1.0 - self.alpha) * beta * squared;
        }
        self.squares.fill([0.0; LANES]);
    }

    /// The distances, candidate by candidate.
    pub fn values(&self) -> &[f64] {
        &self.values
    }
}
