//! (B) Affine subspaces: an origin and an orthonormal basis (equation 1).

use nalgebra::{SMatrix, SVector};
use pulp::{Arch, Simd};
use serde::{Deserialize, Serialize};

use crate::linalg::jacobi;
use crate::params::table::Params;

/// A direction counts when its singular value is above this share of the largest. Below it, single-precision gray
/// values say nothing: one gray step in one pixel of one of six patches is some 0.0001 of the largest singular value.
pub const RANK_TOLERANCE: f64 = 1e-5;

/// The greatest difference of UᵀU from the identity that single precision leaves.
const ORTHONORMAL: f64 = 1e-3;

/// The most vectors that a subspace is made of: P + 1.
pub(crate) const MAX_VECTORS: usize = 11;

/// The Gram matrix of up to [`MAX_VECTORS`] vectors; zero in the rows and columns beyond their number.
pub(crate) type Gram = SMatrix<f64, MAX_VECTORS, MAX_VECTORS>;

/// A coefficient for each of up to [`MAX_VECTORS`] vectors.
type Weights = SVector<f64, MAX_VECTORS>;

/// An affine subspace A = {μ, U} (equation 1) of the space of feature vectors.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct AffineSubspace {
    pub(crate) mean: Vec<f32>,
    /// The columns of U, one after the other.
    pub(crate) basis: Vec<f32>,
}

impl AffineSubspace {
    /// The subspace of feature vectors: μ their mean, U the (up to) `basis_dim` dominant left singular vectors of
    /// the matrix V of which they are the columns (equation 2), uncentred. U has fewer columns where V has fewer
    /// directions with a singular value above [`RANK_TOLERANCE`] of the largest; none for all-zero vectors.
    ///
    /// # Panics
    /// If there are no vectors or more than 11, or their lengths differ.
    pub fn of(vectors: &[&[f32]], basis_dim: usize) -> Self {
        let len = vectors[0].len();
        assert!(
            vectors.iter().all(|vector| vector.len() == len),
            "feature vectors of one length"
        );
        let mut subspace = Self::default();
        fit(&mut subspace, &vectors.concat(), len, basis_dim);
        subspace
    }

    /// The origin μ, of length D.
    pub fn mean(&self) -> &[f32] {
        &self.mean
    }

    /// The columns of U, each of length D.
    pub fn basis(&self) -> impl ExactSizeIterator<Item = &[f32]> {
        self.basis.chunks_exact(self.mean.len().max(1))
    }

    /// The number of columns of U: n, or fewer.
    pub fn dim(&self) -> usize {
        self.basis.len() / self.mean.len().max(1)
    }

    /// Whether this may be a subspace of a tracker with `params`: of its sizes, with orthonormal columns.
    pub(crate) fn is_valid_for(&self, params: &Params) -> bool {
        let (len, dim) = (params.feature_len(), self.dim());
        let has_sizes = self.mean.len() == len
            && self.basis.len().is_multiple_of(len)
            && dim <= params.basis_dim as usize;
        has_sizes && {
            let gram = gram(&self.basis, len);
            gram.view((0, 0), (dim, dim))
                .into_owned()
                .is_identity(ORTHONORMAL)
        }
    }
}

/// Makes `subspace` the subspace [`of`](AffineSubspace::of) `vectors`, each of length `len`, one after the other. The
/// memory of `subspace` is reused.
#[pulp::with_simd(fit = Arch::new())]
#[inline(always)]
pub(crate) fn fit_simd<S: Simd>(
    _: S,
    subspace: &mut AffineSubspace,
    vectors: &[f32],
    len: usize,
    basis_dim: usize,
) {
    let AffineSubspace { mean, basis } = subspace;
    let share = len as f64 / vectors.len() as f64;
    mean.resize(len, 0.0);
    combine(vectors, &Weights::repeat(share), mean);

    // U = V W S⁻¹ with the eigenpairs (S², W) of the Gram matrix VᵀV.
    let (values, w) = jacobi::eigenpairs(gram(vectors, len));
    basis.clear();
    basis.reserve_exact(len * basis_dim);
    let dim = dominant(values.iter().copied(), basis_dim);
    basis.resize(len * dim, 0.0);
    let columns = basis.chunks_exact_mut(len);
    for ((place, value), column) in values.iter().enumerate().zip(columns) {
        combine(vectors, &(w.column(place) / value.sqrt()), column);
    }
}

/// How many of the eigenvalues of a Gram matrix, largest first, count as directions: at most `limit`.
#[inline(always)]
pub(crate) fn dominant(eigenvalues: impl Iterator<Item = f64>, limit: usize) -> usize {
    let mut least = 0.0;
    eigenvalues
        .take(limit)
        .enumerate()
        .take_while(|&(index, value)| {
            if index == 0 {
                least = value * RANK_TOLERANCE * RANK_TOLERANCE;
            }
            value > 0.0 && value > least
        })
        .count()
}

/// VᵀV of vectors of length `len`, one after the other, in double precision.
#[inline(always)]
pub(crate) fn gram(vectors: &[f32], len: usize) -> Gram {
    let mut gram = Gram::zeros();
    for (i, vector) in vectors.chunks_exact(len).enumerate() {
        for (j, other) in vectors.chunks_exact(len).take(i + 1).enumerate() {
            let product = dot(vector, other);
            (gram[(i, j)], gram[(j, i)]) = (product, product);
        }
    }
    gram
}

/// The inner product, in double precision.
#[inline(always)]
fn dot(a: &[f32], b: &[f32]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.map(|(&x, &y)| f64::from(x) * f64::from(y)).sum()
}

/// The sum of vectors, each with its weight, into `out`; in double precision.
#[inline(always)]
fn combine(vectors: &[f32], weights: &Weights, out: &mut [f32]) {
    let len = out.len();
    for (i, out) in out.iter_mut().enumerate() {
        let values = vectors[i..].iter().step_by(len).zip(weights.iter());
        let terms = values.map(|(&value, weight)| weight * f64::from(value));
        *out = terms.sum::<f64>() as f32;
    }
}
