//! The dominant eigenvectors of sixteen small symmetric matrices at once, by Jacobi rotations.
//!
//! A rotation needs two roots and two divisions, which take far longer than all the rest of it. The angle need not be
//! exact, only the rotation a rotation: so the tangent is found in single precision, and Newton's method brings the cosine
//! that goes with it to double precision. What a rotation leaves is then 1e-7 of what there was in place of 1e-16.

use crate::tracker::abreast::{ABREAST, Doubles, inverse_root};

/// Four sweeps are usual; the bound only guards against a NaN.
const MAX_SWEEPS: usize = 16;

/// An off-diagonal element below this share of the trace is rounding.
const NEGLIGIBLE: f64 = 1e-15;

/// So is one whose square is below this share of the product of the two diagonal elements: an eigenvector turns by the
/// root of this at most, unless the two eigenvalues are nearly the same.
const NEGLIGIBLE_SQUARED: f64 = 1e-13;

/// Keeps 0 / 0 out of single precision.
const LEAST: f32 = 1e-30;

/// Diagonalises symmetric positive semidefinite matrices of size `dim` and trace 1 (or 0), each `dim * dim` in row order, of which
/// the upper triangle counts. Their diagonals end as the eigenvalues, in no order, and `vectors` with the eigenvector of
/// the `j`-th diagonal element in its `j`-th row.
#[inline(always)]
pub(crate) fn diagonalize(matrix: &mut [Doubles], vectors: &mut [Doubles], dim: usize) {
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
        // At most 1 even where the squares underflowed.
        let root = if root > twice.abs() {
            root
        } else {
            twice.abs()
        };
        tangent[lane] = twice * 1.0_f32.copysign(gap) / root;
        inverse[lane] = inverse_root(tangent[lane] * tangent[lane]);
    }
    let (mut sine, mut cosine) = ([0.0; ABREAST], [0.0; ABREAST]);
    for lane in 0..ABREAST {
        let tangent = f64::from(tangent[lane]);
        let square = tangent * tangent;
        let half = 0.5 * (1.0 + square);
        let first = f64::from(inverse[lane]);
        let second = first * (1.5 - half * first * first);
        let inverse = second * (1.5 - half * second * second);
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
pub(crate) fn sort(matrix: &mut [Doubles], vectors: &mut [Doubles], dim: usize, count: usize) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::linalg::jacobi::Spectrum;

    /// diag(Λ, 0) + z zᵀ of trace 1, with eigenvalues of very different sizes.
    fn matrix(dim: usize, seed: usize) -> Vec<f64> {
        let number = |i: usize| ((i * 37 + seed * 53) % 97) as f64 / 97.0 - 0.5;
        let z: Vec<f64> = (0..dim)
            .map(|i| number(i) * 0.3_f64.powi(i as i32))
            .collect();
        let value = |i: usize, j: usize| {
            let own = if i == j && i + 1 < dim {
                0.1_f64.powi(i as i32)
            } else {
                0.0
            };
            z[i] * z[j] + own
        };
        let trace: f64 = (0..dim).map(|i| value(i, i)).sum();
        (0..dim * dim)
            .map(|index| value(index / dim, index % dim) / trace.max(1e-300))
            .collect()
    }

    #[test]
    fn the_greatest_come_first_with_their_vectors_and_lanes_do_not_mix() {
        for dim in 2..=11 {
            let all: Vec<Vec<f64>> = (0..ABREAST).map(|lane| matrix(dim, lane)).collect();
            let mut lanes: Vec<Doubles> = (0..dim * dim)
                .map(|index| std::array::from_fn(|lane| all[lane][index]))
                .collect();
            let mut vectors = vec![[0.0; ABREAST]; dim * dim];
            diagonalize(&mut lanes, &mut vectors, dim);
            sort(&mut lanes, &mut vectors, dim, 3);
            for (lane, matrix) in all.iter().enumerate() {
                let mut spectrum = Spectrum::default();
                spectrum.solve(dim, |i, j| matrix[i * dim + j]);
                for (j, expected) in spectrum.values().enumerate().take(3) {
                    let value = lanes[j * dim + j][lane];
                    assert!((value - expected).abs() < 1e-12, "{dim} {lane} {j}");
                    let weight = |i| spectrum.weight(j, i);
                    let product = |i: usize| vectors[j * dim + i][lane] * weight(i);
                    let cosine: f64 = (0..dim).map(product).sum();
                    let square: f64 = (0..dim).map(|i| vectors[j * dim + i][lane].powi(2)).sum();
                    assert!((square - 1.0).abs() < 1e-13, "{dim} {lane} {j}: {square}");
                    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
                    assert!(sine < 1e-6, "{dim} {lane} {j}: {sine}");
                }
            }
        }
    }

    #[test]
    fn zeros_and_ones_stay_finite() {
        for value in [0.0, 1.0 / 4.0, 1e-20] {
            let mut matrix = vec![[value; ABREAST]; 16];
            let mut vectors = vec![[0.0; ABREAST]; 16];
            diagonalize(&mut matrix, &mut vectors, 4);
            sort(&mut matrix, &mut vectors, 4, 4);
            let all = matrix.iter().chain(&vectors).flatten();
            assert!(all.clone().all(|value| value.is_finite()));
            assert!((matrix[0][7] - 4.0 * value).abs() < 1e-14);
        }
    }
}
