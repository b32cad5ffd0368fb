//! Eigenvalues and eigenvectors of a small symmetric matrix, by cyclic Jacobi rotations: the method with the smallest
//! relative errors on positive semidefinite matrices, and one that always ends.
//!
//! Own code: nalgebra's decomposition of a matrix of any size allocates on each call, which a step must not. It takes
//! 1.6 times as long for 3 rows, 0.6 times for 5 (docs/laboratory/NEGATIVE_RESULTS.md); both are about a microsecond.

use nalgebra::{SMatrix, SVector};

/// Cyclic Jacobi needs four to six sweeps at these sizes; the bound ends it on NaN.
const MAX_SWEEPS: usize = 16;

/// An off-diagonal element below this share of the trace is rounding.
const NEGLIGIBLE: f64 = 1e-16;

/// Without eigenvectors, an off-diagonal element is also rounding if its square is below this share of the product of
/// the two diagonal elements. That moves the two by 1e-6 of themselves at most, and only where they are nearly equal;
/// never their sum.
const NEGLIGIBLE_SQUARED: f64 = 1e-12;

/// Diagonalises a symmetric positive semidefinite matrix of size `dim`, in row order, of which the upper triangle is
/// read. Leaves the eigenvalues on its diagonal, in no order, and in row `j` of `vectors` the eigenvector of the `j`-th
/// of them. An empty `vectors` asks for the eigenvalues alone, to six digits.
#[inline(always)]
fn diagonalize(matrix: &mut [f64], vectors: &mut [f64], dim: usize) {
    let mut floor = 0.0;
    for j in 0..dim {
        floor += matrix[j * dim + j] * NEGLIGIBLE;
    }
    let relative = if vectors.is_empty() {
        NEGLIGIBLE_SQUARED
    } else {
        0.0
    };
    vectors.fill(0.0);
    vectors.iter_mut().step_by(dim + 1).for_each(|it| *it = 1.0);
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for p in 0..dim {
            for q in p + 1..dim {
                let off = matrix[p * dim + q];
                let share = relative * matrix[p * dim + p] * matrix[q * dim + q];
                if off.abs() > floor && off * off > share {
                    rotated = true;
                    rotate(matrix, vectors, dim, p, q);
                }
            }
        }
        if !rotated {
            break;
        }
    }
}

/// Zeroes element (p, q), p < q, by a rotation.
#[inline(always)]
fn rotate(matrix: &mut [f64], vectors: &mut [f64], dim: usize, p: usize, q: usize) {
    let (pp, qq, pq) = (p * dim + p, q * dim + q, p * dim + q);
    let off = matrix[pq];
    let gap = matrix[qq] - matrix[pp];
    let twice = off + off;
    // The smaller root, without a branch; MIN_POSITIVE keeps 0 / 0 out where there is nothing to rotate.
    let root = (gap * gap + twice * twice).sqrt() + gap.abs() + f64::MIN_POSITIVE;
    let tangent = twice * 1.0_f64.copysign(gap) / root;
    let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
    let sine = tangent * cosine;
    matrix[pp] -= tangent * off;
    matrix[qq] += tangent * off;
    matrix[pq] = 0.0;
    for r in (0..dim).filter(|&r| r != p && r != q) {
        let rp = r.min(p) * dim + r.max(p);
        let rq = r.min(q) * dim + r.max(q);
        rotate_pair(matrix, rp, rq, cosine, sine);
    }
    for r in 0..dim.min(vectors.len()) {
        rotate_pair(vectors, p * dim + r, q * dim + r, cosine, sine);
    }
}

#[inline(always)]
fn rotate_pair(values: &mut [f64], p: usize, q: usize, cosine: f64, sine: f64) {
    let (at_p, at_q) = (values[p], values[q]);
    values[p] = cosine * at_p - sine * at_q;
    values[q] = sine * at_p + cosine * at_q;
}

/// The eigenvalues of a symmetric positive semidefinite matrix, largest first, and their eigenvectors as columns. Rows
/// and columns of zeros at the end of the matrix change no other eigenpair.
#[inline(always)]
pub(crate) fn eigenpairs<const M: usize>(
    mut matrix: SMatrix<f64, M, M>,
) -> (SVector<f64, M>, SMatrix<f64, M, M>) {
    let mut vectors = SMatrix::<f64, M, M>::zeros();
    // The matrix is symmetric, so that the order of rows and columns does not matter; rows of vectors become columns.
    diagonalize(matrix.as_mut_slice(), vectors.as_mut_slice(), M);
    let mut values = matrix.diagonal();
    for j in 0..M {
        for other in j + 1..M {
            if values[other] > values[j] {
                values.swap_rows(j, other);
                vectors.swap_columns(j, other);
            }
        }
    }
    (values, vectors)
}

/// The eigenvalues of a symmetric positive semidefinite matrix, largest first, to six digits; their sum is exact.
#[inline(always)]
pub(crate) fn eigenvalues<const N: usize>(mut matrix: SMatrix<f64, N, N>) -> SVector<f64, N> {
    diagonalize(matrix.as_mut_slice(), &mut [], N);
    let mut values = matrix.diagonal();
    values.as_mut_slice().sort_by(|a, b| b.total_cmp(a));
    values
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;

    /// The eleven eigenpairs of a matrix of `dim` rows padded with zeros; of each vector the first `dim` components.
    fn padded(matrix: &[f64], dim: usize) -> Vec<(f64, Vec<f64>)> {
        let element = |i: usize, j: usize| match i.max(j) < dim {
            true => matrix[i * dim + j],
            false => 0.0,
        };
        let (values, vectors) = eigenpairs(SMatrix::<f64, 11, 11>::from_fn(element));
        let vector = |rank: usize| vectors.column(rank).rows(0, dim).iter().copied().collect();
        (0..11).map(|rank| (values[rank], vector(rank))).collect()
    }

    /// A positive semidefinite matrix of some rank, with eigenvalues of very different sizes.
    fn matrix(dim: usize, rank: usize, seed: usize) -> DMatrix<f64> {
        let factor = DMatrix::from_fn(dim, rank, |i, j| {
            let hash = (i * 37 + j * 101 + seed * 53) % 97;
            (hash as f64 / 97.0 - 0.5) * 10_f64.powi(-(j as i32))
        });
        &factor * factor.transpose()
    }

    #[test]
    fn eigenpairs_rebuild_the_matrix() {
        for dim in 1..=11 {
            for rank in 1..=dim {
                let expected = matrix(dim, rank, dim);
                let pairs = padded(expected.as_slice(), dim);
                let mut rebuilt = DMatrix::zeros(dim, dim);
                for (value, vector) in &pairs {
                    let vector = DMatrix::from_column_slice(dim, 1, vector);
                    // Where the value is 0 the vector may be one of the padding.
                    let counts = *value > 1e-14 * pairs[0].0;
                    assert!(!counts || (vector.norm() - 1.0).abs() < 1e-12);
                    rebuilt += &vector * vector.transpose() * *value;
                }
                assert!((rebuilt - &expected).norm() < 1e-13 * expected.norm().max(1e-300));
                assert!(pairs.windows(2).all(|pair| pair[0].0 >= pair[1].0));
            }
        }
    }

    #[test]
    fn eigenvalues_alone_are_those_of_the_pairs_to_six_digits() {
        for rank in 1..=6 {
            let given = matrix(6, rank, rank);
            let pairs = padded(given.as_slice(), 6);
            let alone = eigenvalues(SMatrix::<f64, 6, 6>::from_fn(|i, j| given[(i, j)]));
            for (value, (expected, _)) in alone.iter().zip(&pairs) {
                assert!((value - expected).abs() < 1e-6 * expected + 1e-15 * pairs[0].0);
            }
        }
    }

    #[test]
    fn equal_elements_give_finite_numbers() {
        for value in [0.0, 1.0, 1e-300, 1e8] {
            for (eigenvalue, vector) in padded(&[value; 9], 3) {
                assert!(eigenvalue.is_finite() && vector.iter().all(|v| v.is_finite()));
            }
        }
    }
}
