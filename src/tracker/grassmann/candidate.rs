//! The affine subspace of a candidate (equation 1), from the Gram matrix of V (equation 2).

use nalgebra::SMatrix;

use crate::tracker::appearance::subspace;
use crate::tracker::linalg::jacobi;

/// The subspace {μ, U} of a candidate with V of up to M columns, as what V's columns are multiplied with.
#[derive(Debug)]
pub(crate) struct Candidate<const M: usize, const N: usize> {
    /// ‖μ‖².
    pub mean_square: f64,
    /// W S⁻¹, so that U = V W S⁻¹: zero beyond the columns that U has.
    pub coefficients: SMatrix<f64, M, N>,
    /// The number of columns of U: n, or fewer where V has fewer directions.
    pub dim: usize,
}

impl<const M: usize, const N: usize> Candidate<M, N> {
    /// The subspace with `gram` = VᵀV, zero beyond V's `columns`, and at most `basis_dim` basis vectors.
    pub fn of(gram: SMatrix<f64, M, M>, columns: usize, basis_dim: usize) -> Self {
        // VᵀV = W S² Wᵀ.
        let (squares, w) = jacobi::eigenpairs(gram);
        let dim = subspace::dominant(squares.iter().copied(), basis_dim);
        let mut coefficients = SMatrix::<f64, M, N>::zeros();
        for column in 0..dim {
            coefficients.set_column(column, &(w.column(column) / squares[column].sqrt()));
        }
        Self {
            // μ = V 1 / (P + 1).
            mean_square: gram.sum() / (columns * columns) as f64,
            coefficients,
            dim,
        }
    }
}
