//! The affine subspaces of a batch of candidates (equation 1), from the Gram matrices of V (equation 2).

use nalgebra::{SMatrix, SimdComplexField, SimdPartialOrd, SimdValue};

use crate::grassmann::Lanes;
use crate::grassmann::subspace::RANK_TOLERANCE;
use crate::linalg::jacobi;

/// The subspaces {μ, U} of candidates with V of up to M columns, as what V's columns are multiplied with.
#[derive(Debug)]
pub(crate) struct Batch<const M: usize, const N: usize> {
    /// ‖μ‖².
    pub mean_square: Lanes,
    /// W S⁻¹, so that U = V W S⁻¹: zero beyond the columns that U has.
    pub coefficients: SMatrix<Lanes, M, N>,
    /// The number of columns of U: n, or fewer where V has fewer directions.
    pub dim: Lanes,
}

impl<const M: usize, const N: usize> Batch<M, N> {
    /// The subspaces with `gram` = VᵀV, zero beyond V's `columns`, and at most `basis_dim` basis vectors.
    #[inline(always)]
    pub fn of(gram: &SMatrix<Lanes, M, M>, columns: usize, basis_dim: usize) -> Self {
        // VᵀV = W S² Wᵀ.
        let (squares, w) = jacobi::eigenpairs(*gram);
        let least = squares[0] * Lanes::splat(RANK_TOLERANCE * RANK_TOLERANCE);
        let (zero, one) = (Lanes::splat(0.0), Lanes::splat(1.0));
        let (mut coefficients, mut dim) = (SMatrix::zeros(), zero);
        for j in 0..basis_dim {
            let is_direction = squares[j].simd_gt(least.simd_max(zero));
            let inverse = (one / squares[j].simd_sqrt()).select(is_direction, zero);
            for i in 0..M {
                coefficients[(i, j)] = w[(i, j)] * inverse;
            }
            dim += one.select(is_direction, zero);
        }
        Self {
            // μ = V 1 / (P + 1).
            mean_square: gram.sum() / Lanes::splat((columns * columns) as f64),
            coefficients,
            dim,
        }
    }
}
