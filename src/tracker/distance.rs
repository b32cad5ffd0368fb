//! (D) The distance of two affine subspaces (equations 4 to 8), from inner products.
//!
//! Where two bases differ in their number of columns, the smaller number is the n of equation 8; bases without any
//! column have the Grassmann distance 0, so that the origins decide.

use std::f32::consts::PI;

use crate::tracker::abreast::{ABREAST, Doubles, Singles};
use crate::tracker::candidate::CandidateBases;
use crate::tracker::params::table::Params;
use crate::tracker::products::Products;
use crate::tracker::singular::{self, Columns};

/// The distances of all candidates to all entries of the bag.
#[derive(Debug, Clone, Default)]
pub(crate) struct Distances {
    alpha: f64,
    /// γ (equation 5).
    gamma: f64,
    /// n.
    limit: usize,
    /// For each candidate, its distance to each entry.
    values: Vec<f64>,
}

impl Distances {
    /// Makes room for these parameters.
    pub fn prepare(&mut self, params: &Params) {
        self.limit = params.basis_dim as usize;
        self.alpha = params.alpha;
        self.gamma = params.gamma();
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
        self.values.resize(candidates * entries.len(), 0.0);
        let all = (products, bases, entries);
        // Columns of zeros at the end change nothing; a function for each number of columns would be six.
        if self.limit <= 3 {
            self.compute_all::<3>(all);
        } else {
            self.compute_all::<6>(all);
        }
    }

    #[inline(always)]
    fn compute_all<const N: usize>(
        &mut self,
        (products, bases, entries): (&Products, &CandidateBases, &[(f64, usize)]),
    ) {
        let count = entries.len();
        let groups = self.values.chunks_mut(ABREAST * count).enumerate();
        for (group, values) in groups {
            for (k, &(norm, dim)) in entries.iter().enumerate() {
                let mut distances = origins(products, group, k, norm);
                for distance in &mut distances {
                    *distance *= self.alpha * self.gamma;
                }
                if self.alpha < 1.0 {
                    let angles = grassmann::<N>(products, bases, group, (k, dim));
                    for lane in 0..ABREAST {
                        distances[lane] += (1.0 - self.alpha) * f64::from(angles[lane]);
                    }
                }
                for (row, distance) in values.chunks_exact_mut(count).zip(distances) {
                    row[k] = distance;
                }
            }
        }
    }

    /// The distances, candidate by candidate.
    pub fn values(&self) -> &[f64] {
        &self.values
    }
}

/// ‖μᵢ - μₖ‖² (equation 5) of a group of candidates; `norm` is ‖μₖ‖². The sum of V is h + the sum of H, and d.
#[inline(always)]
fn origins(products: &Products, index: usize, k: usize, norm: f64) -> Doubles {
    let group = products.group(index);
    let share = 1.0 / (products.history().count() as f64 + 1.0);
    let (shared_norm, shared_mean) = (products.history().sum_norm(), products.shared_means()[k]);
    let (square, with_shared) = (group.square(), group.with_shared());
    let with_mean = group.with_mean(k);
    let mut distances = [0.0; ABREAST];
    for lane in 0..ABREAST {
        let own = shared_norm + 2.0 * f64::from(with_shared[lane]) + square[lane];
        let both = shared_mean + f64::from(with_mean[lane]);
        let squared = own * share * share - 2.0 * both * share + norm;
        distances[lane] = if squared > 0.0 { squared } else { 0.0 };
    }
    distances
}

/// β Σ θ² (equations 6 to 8), β = 4 / (n π²), of a group of candidates and entry `k` of `dim` basis vectors.
#[inline(always)]
fn grassmann<const N: usize>(
    products: &Products,
    bases: &CandidateBases,
    group: usize,
    (k, dim): (usize, usize),
) -> Singles {
    let own = products.group(group);
    let count = products.shared_means().len();
    let slots = products.history().eigenvalues().len();
    let limit = bases.limit();
    let mut columns: Columns<N> = [[[0.0; ABREAST]; N]; N];
    for (i, column) in columns.iter_mut().enumerate().take(limit) {
        let coefficients = bases.column(group, i);
        for (j, product) in column.iter_mut().enumerate().take(limit) {
            let (with_basis, of_rest) = (own.with_basis(j, k), &coefficients[slots]);
            let mut sum = [0.0; ABREAST];
            for lane in 0..ABREAST {
                sum[lane] = of_rest[lane] * with_basis[lane];
            }
            for (slot, coefficient) in coefficients[..slots].iter().enumerate() {
                let of_direction = products.of_direction(slot)[j * count + k];
                for lane in 0..ABREAST {
                    sum[lane] += coefficient[lane] * of_direction;
                }
            }
            *product = sum;
        }
    }
    let mut dims = *bases.dims(group);
    for own in &mut dims {
        *own = own.min(dim as f32);
    }
    let mut distances = singular::squared_angles(&mut columns, &dims);
    for lane in 0..ABREAST {
        // Without a basis nothing is added.
        distances[lane] *= 4.0 / (dims[lane].max(1.0) * PI * PI);
    }
    distances
}
