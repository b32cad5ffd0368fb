//! (B) The affine subspaces of all candidates, in the coordinates of the shared history.
//!
//! V = [v, H] (equation 2). With the orthonormal Q of [`products`](crate::tracker::products), q = Qᵀv, and e the unit vector
//! of the rest v - Qq, whose length is ρ, V Vᵀ is diag(Λ, 0) + z zᵀ in the basis [Q, e], where z = (q, ρ). So the
//! left singular vectors of V are [Q, e] times the eigenvectors of a matrix of P + 1 rows. They are as well combinations
//! of Q and d = v - h, so Uᵀf for any f follows from Qᵀf and dᵀf.
//!
//! Dividing by ρ is harmless however small it is: the coordinate of a counting direction along e is ρ times a bounded
//! number (the z of an eigenvector over its eigenvalue).

use crate::tracker::abreast::{ABREAST, Doubles, Singles};
use crate::tracker::appearance::subspace::RANK_TOLERANCE;
use crate::tracker::dominant;
use crate::tracker::params::table::Params;
use crate::tracker::products::Products;

/// The bases of all candidates of a frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct CandidateBases {
    /// n.
    limit: usize,
    /// P + 1.
    size: usize,
    /// For each group of candidates n columns of P + 1 coefficients, of Q and of d.
    coefficients: Vec<Singles>,
    /// For each candidate the number of columns that count.
    dims: Vec<Singles>,
    matrix: Vec<Doubles>,
    vectors: Vec<Doubles>,
}

impl CandidateBases {
    /// Makes room for these parameters.
    pub fn prepare(&mut self, params: &Params) {
        (self.limit, self.size) = (params.basis_dim as usize, params.history as usize + 1);
        let groups = (params.particles as usize).div_ceil(ABREAST);
        let columns = groups * self.limit * self.size;
        self.coefficients.resize(columns, [0.0; ABREAST]);
        self.dims.resize(groups, [0.0; ABREAST]);
        self.matrix.resize(self.size * self.size, [0.0; ABREAST]);
        self.vectors.resize(self.size * self.size, [0.0; ABREAST]);
    }

    /// Finds the basis of every candidate.
    #[inline(always)]
    pub fn compute(&mut self, products: &Products) {
        for group in 0..products.groups() {
            self.fill(products, group);
            dominant::diagonalize(&mut self.matrix, &mut self.vectors, self.size);
            dominant::sort(&mut self.matrix, &mut self.vectors, self.size, self.limit);
            self.take(products, group);
        }
    }

    /// diag(Λ, 0) + z zᵀ of a group of candidates, upper triangle, scaled to a trace of 1.
    #[inline(always)]
    fn fill(&mut self, products: &Products, index: usize) {
        let (size, last) = (self.size, self.size - 1);
        let eigenvalues = products.history().eigenvalues();
        let mut trace = [eigenvalues.iter().sum::<f64>(); ABREAST];
        for i in 0..size {
            let z = coordinate(products, index, i);
            for lane in 0..ABREAST {
                trace[lane] += z[lane] * z[lane];
            }
        }
        let mut scale = [0.0; ABREAST];
        for lane in 0..ABREAST {
            scale[lane] = 1.0 / trace[lane].max(f64::MIN_POSITIVE);
        }
        for i in 0..size {
            let a = coordinate(products, index, i);
            for j in i..size {
                let b = coordinate(products, index, j);
                let element = &mut self.matrix[i * size + j];
                for lane in 0..ABREAST {
                    element[lane] = a[lane] * b[lane] * scale[lane];
                }
            }
            if let Some(eigenvalue) = eigenvalues[..last].get(i) {
                let element = &mut self.matrix[i * size + i];
                for lane in 0..ABREAST {
                    element[lane] += eigenvalue * scale[lane];
                }
            }
        }
    }

    /// The n dominant eigenvectors of a group of candidates.
    #[inline(always)]
    fn take(&mut self, products: &Products, index: usize) {
        let group = products.group(index);
        let (size, last) = (self.size, self.size - 1);
        let mut inverse = [0.0_f32; ABREAST];
        for (inverse, &rest) in inverse.iter_mut().zip(group.rest()) {
            *inverse = if rest > 0.0 { (1.0 / rest) as f32 } else { 0.0 };
        }
        let greatest = self.matrix[0];
        let mut dims = [0.0_f32; ABREAST];
        let columns = &mut self.coefficients[index * self.limit * size..][..self.limit * size];
        for (j, column) in columns.chunks_exact_mut(size).enumerate() {
            // A matrix of P + 1 rows has no more eigenvectors.
            if j >= size {
                column.fill([0.0; ABREAST]);
                continue;
            }
            let value = &self.matrix[j * size + j];
            let mut counts = [0.0_f32; ABREAST];
            for lane in 0..ABREAST {
                let least = greatest[lane] * RANK_TOLERANCE * RANK_TOLERANCE;
                let is_direction = value[lane] > least;
                counts[lane] = if is_direction { 1.0 } else { 0.0 };
                dims[lane] += counts[lane];
            }
            let vector = &self.vectors[j * size..][..size];
            let mut of_rest = [0.0_f32; ABREAST];
            for lane in 0..ABREAST {
                of_rest[lane] = vector[last][lane] as f32 * inverse[lane] * counts[lane];
            }
            for slot in 0..last {
                let along = group.along(slot);
                for lane in 0..ABREAST {
                    let inside = vector[slot][lane] as f32 * counts[lane];
                    column[slot][lane] = inside - of_rest[lane] * along[lane];
                }
            }
            column[last] = of_rest;
        }
        self.dims[index] = dims;
    }

    /// n.
    #[inline(always)]
    pub fn limit(&self) -> usize {
        self.limit
    }

    /// The number of basis vectors of a candidate.
    pub fn dim(&self, candidate: usize) -> usize {
        self.dims[candidate / ABREAST][candidate % ABREAST] as usize
    }

    /// The numbers of basis vectors of a group of candidates.
    #[inline(always)]
    pub fn dims(&self, group: usize) -> &Singles {
        &self.dims[group]
    }

    /// The coefficients of column `column` of U of a group of candidates: of Q, then of what of the candidates their
    /// products are of.
    #[inline(always)]
    pub fn column(&self, group: usize, column: usize) -> &[Singles] {
        &self.coefficients[(group * self.limit + column) * self.size..][..self.size]
    }
}

/// z = (q, ρ) of a group of candidates.
#[inline(always)]
fn coordinate(products: &Products, group: usize, i: usize) -> &Doubles {
    let group = products.group(group);
    if i < products.history().eigenvalues().len() {
        group.coordinate(i)
    } else {
        group.rest()
    }
}
