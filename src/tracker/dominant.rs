//! The dominant eigenvectors of sixteen small symmetric matrices at once, by Jacobi rotations.
//!
//! A rotation needs two roots and two divisions, which take far longer than all the rest of it. The angle need not be
//! exact, only the rotation a rotation: so the tangent is found in single precision, and one step of Newton's brings the cosine that
//! goes with it to double precision. What a rotation leaves is then 1e-7 of what there was in place of 1e-16.

use super::abreast::{ABREAST, Doubles};

/// Four sweeps are usual; the bound only guards against a NaN.
const MAX_SWEEPS: usize = 16;

/// An off-diagonal element below this share of the trace is rounding.
const NEGLIGIBLE: f64 = 1e-15;

/// So is one whose square is below this share of the product of the two diagonal elements: an eigenvector turns by the
/// root of this at most, unless the two eigenvalues are nearly the same.
const NEGLIGIBLE_SQUARED: f64 = 1e-14;

/// Keeps 0 / 0 out of single precision.
const LEAST: f32 = 1e-30;

/// Diagonalises symmetric positive semidefinite matrices of size `dim` and trace 1 (or 0), each `dim * dim` in row order, of which
/// the upper triangle counts. Their diagonals end as the eigenvalues, in no order, and `vectors` with the eigenvector of
/// the `j`-th diagonal element in its `j`-th row.
#[inline(always)]
pub(super) fn diagonalize(matrix: &mut [Doubles], vectors: &mut [Doubles], dim: usize) {
    vectors.fill([0.0; ABREAST]);
    for j in 0..dim {
        vectors[j * dim + j] = [1.0; ABREAST];
    }
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for p in 0..dim {
            for q in p + 1..dim {
                let (a, b) = (&matrix[p * dim + p], &matrix[q * dim + q]);
                let off = &matrix[p * dim + q];
                let mut counts = 0_u32;
                for lane in 0..ABREAST {
                    let is_small = off[lane] * off[lane] <= NEGLIGIBLE_SQUARED * a[lane] * b[lane];
                    counts |= u32::from(!is_small & (off[lane].abs() > NEGLIGIBLE));
                }
                if counts != 0 {
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

/// All but zeroes element (p, q) of every lane, p < q.
#[inline(always)]
fn rotate(matrix: &mut [Doubles], vectors: &mut [Doubles], dim: usize, p: usize, q: usize) {
    let (pp, qq, pq) = (p * dim + p, q * dim + q, p * dim + q);
    let (a, b, off) = (matrix[pp], matrix[qq], matrix[pq]);
    let (mut tangent, mut inverse) = ([0.0_f32; ABREAST], [0.0_f32; ABREAST]);
    for lane in 0..ABREAST {
        let gap = (b[lane] - a[lane]) as f32;
        let twice = 2.0 * off[lane] as f32;
        let root = (gap * gap + twice * twice).sqrt() + gap.abs() + LEAST;
        tangent[lane] = twice * 1.0_f32.copysign(gap) / root;
        inverse[lane] = 1.0 / (tangent[lane] * tangent[lane] + 1.0).sqrt();
    }
    let (mut sine, mut cosine) = ([0.0; ABREAST], [0.0; ABREAST]);
    for lane in 0..ABREAST {
        let (tangent, first) = (f64::from(tangent[lane]), f64::from(inverse[lane]));
        let square = tangent * tangent;
        let inverse = first * (1.5 - 0.5 * (1.0 + square) * first * first);
        let share = inverse * inverse;
        let both = 2.0 * tangent * off[lane];
        cosine[lane] = inverse;
        sine[lane] = tangent * inverse;
        matrix[pp][lane] = share * (a[lane] - both + square * b[lane]);
        matrix[qq][lane] = share * (square * a[lane] + both + b[lane]);
        let left = (1.0 - square) * off[lane] - tangent * (b[lane] - a[lane]);
        matrix[pq][lane] = share * left;
    }
    for r in (0..dim).filter(|&r| r != p && r != q) {
        let rp = r.min(p) * dim + r.max(p);
        let rq = r.min(q) * dim + r.max(q);
        turn(matrix, rp, rq, &cosine, &sine);
    }
    for r in 0..dim {
        turn(vectors, p * dim + r, q * dim + r, &cosine, &sine);
    }
}

#[inline(always)]
fn turn(values: &mut [Doubles], p: usize, q: usize, cosine: &Doubles, sine: &Doubles) {
    let (at_p, at_q) = (values[p], values[q]);
    for lane in 0..ABREAST {
        values[p][lane] = cosine[lane] * at_p[lane] - sine[lane] * at_q[lane];
        values[q][lane] = sine[lane] * at_p[lane] + cosine[lane] * at_q[lane];
    }
}

/// Brings the `count` greatest eigenvalues to the front of the diagonal, the greatest first, and their vectors with them.
#[inline(always)]
pub(super) fn sort(matrix: &mut [Doubles], vectors: &mut [Doubles], dim: usize, count: usize) {
    for i in 0..count.min(dim) {
        for j in i + 1..dim {
            let (a, b) = (matrix[i * dim + i], matrix[j * dim + j]);
            for lane in 0..ABREAST {
                let is_less = a[lane] < b[lane];
                matrix[i * dim + i][lane] = if is_less { b[lane] } else { a[lane] };
                matrix[j * dim + j][lane] = if is_less { a[lane] } else { b[lane] };
            }
            for r in 0..dim {
                let (x, y) = (vectors[i * dim + r], vectors[j * dim + r]);
                for lane in 0..ABREAST {
                    let is_less = a[lane] < b[lane];
                    vectors[i * dim + r][lane] = if is_less { y[lane] } else { x[lane] };
                    vectors[j * dim + r][lane] = if is_less { x[lane] } else { y[lane] };
                }
            }
        }
    }
}
