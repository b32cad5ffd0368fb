//! (D) The principal angles of sixteen pairs of subspaces at once, in single precision.
//!
//! The cosines are the singular values of a matrix of n rows (equation 6). Rotations of its columns until these are orthogonal
//! (Hestenes) never square it, so a cosine is off by a few 1e-7 however small it is; as roots of eigenvalues small cosines
//! would lose half of the digits.

use std::f32::consts::FRAC_PI_2;

use crate::tracker::abreast::{ABREAST, Singles, inverse_root};

/// Three sweeps are usual; the bound only guards against a NaN.
const MAX_SWEEPS: usize = 10;

/// Columns whose cosine (squared) is below this are orthogonal: the smaller singular value is off by half of it.
const ORTHOGONAL: f32 = 1e-9;

/// Keeps 0 / 0 out.
const LEAST: f32 = 1e-30;

/// arcsin²(√y) / y on [0, 1/2], lowest power first: the Chebyshev fit of degree 8, off by less than 1e-8 before rounding.
const ARCSIN_SQUARED: [f32; 9] = [
    1.0,
    0.333_331_56,
    0.177_868_76,
    0.112_501_55,
    0.098_561_61,
    -0.030_632_33,
    0.327_472_65,
    -0.418_486_6,
    0.372_402_46,
];

/// N columns of N values, of each of [`ABREAST`] matrices.
pub(crate) type Columns<const N: usize> = [[Singles; N]; N];

/// Σ θ² over the `dims` largest singular values cos θ of each matrix.
#[inline(always)]
pub(crate) fn squared_angles<const N: usize>(columns: &mut Columns<N>, dims: &Singles) -> Singles {
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for p in 0..N {
            for q in p + 1..N {
                rotated |= rotate(columns, p, q);
            }
        }
        if !rotated {
            break;
        }
    }
    let mut squares = [[0.0; ABREAST]; N];
    for (square, column) in squares.iter_mut().zip(columns.iter()) {
        *square = product(column, column);
    }
    sort(&mut squares);
    let mut sum = [0.0; ABREAST];
    let mut place = 0.0;
    for square in &squares {
        for lane in 0..ABREAST {
            let angle = squared_angle(square[lane]);
            sum[lane] += if place < dims[lane] { angle } else { 0.0 };
        }
        place += 1.0;
    }
    sum
}

/// Makes two columns orthogonal, unless they are.
#[inline(always)]
fn rotate<const N: usize>(columns: &mut Columns<N>, p: usize, q: usize) -> bool {
    let a = product(&columns[p], &columns[p]);
    let b = product(&columns[q], &columns[q]);
    let both = product(&columns[p], &columns[q]);
    let mut counts = 0_u32;
    for lane in 0..ABREAST {
        counts |= u32::from(both[lane] * both[lane] > ORTHOGONAL * a[lane] * b[lane]);
    }
    if counts == 0 {
        return false;
    }
    let (mut sine, mut cosine) = ([0.0; ABREAST], [0.0; ABREAST]);
    for lane in 0..ABREAST {
        let gap = b[lane] - a[lane];
        let twice = 2.0 * both[lane];
        let root = (gap * gap + twice * twice).sqrt() + gap.abs() + LEAST;
        // At most 1 even where the squares underflowed.
        let root = if root > twice.abs() {
            root
        } else {
            twice.abs()
        };
        let tangent = twice * 1.0_f32.copysign(gap) / root;
        let square = tangent * tangent;
        let first = inverse_root(square);
        cosine[lane] = first * (1.5 - (0.5 + 0.5 * square) * first * first);
        sine[lane] = tangent * cosine[lane];
    }
    let (first, second) = (columns[p], columns[q]);
    for (i, (x, y)) in first.iter().zip(&second).enumerate() {
        for lane in 0..ABREAST {
            columns[p][i][lane] = cosine[lane] * x[lane] - sine[lane] * y[lane];
            columns[q][i][lane] = sine[lane] * x[lane] + cosine[lane] * y[lane];
        }
    }
    true
}

#[inline(always)]
fn product<const N: usize>(a: &[Singles; N], b: &[Singles; N]) -> Singles {
    let mut sum = [0.0; ABREAST];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..ABREAST {
            sum[lane] += a[lane] * b[lane];
        }
    }
    sum
}

/// Largest first.
#[inline(always)]
fn sort<const N: usize>(values: &mut [Singles; N]) {
    for i in 0..N {
        for j in i + 1..N {
            let (a, b) = (values[i], values[j]);
            for lane in 0..ABREAST {
                let is_less = a[lane] < b[lane];
                values[i][lane] = if is_less { b[lane] } else { a[lane] };
                values[j][lane] = if is_less { a[lane] } else { b[lane] };
            }
        }
    }
}

/// θ² in [0, π²/4] of cos²θ; what rounding has put above 1 counts as 1.
#[inline(always)]
fn squared_angle(squared_cosine: f32) -> f32 {
    let cosine = if squared_cosine < 1.0 {
        squared_cosine
    } else {
        1.0
    };
    let sine = 1.0 - cosine;
    let lesser = if cosine < sine { cosine } else { sine };
    let mut ratio = 0.0;
    for coefficient in ARCSIN_SQUARED.iter().rev() {
        ratio = ratio * lesser + coefficient;
    }
    let squared = ratio * lesser;
    // arccos x is arcsin √(1 - x²), and π/2 - arcsin x.
    let complement = FRAC_PI_2 - squared.sqrt();
    if cosine < sine {
        complement * complement
    } else {
        squared
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;

    /// Σ θ² of the `dim` largest singular values.
    fn expected(matrix: &DMatrix<f64>, dim: usize) -> f64 {
        let mut values: Vec<f64> = matrix.singular_values().iter().copied().collect();
        values.sort_by(|a, b| b.total_cmp(a));
        let angles = values[..dim].iter().map(|value| value.min(1.0).acos());
        angles.map(|angle| angle * angle).sum()
    }

    fn check<const N: usize>() {
        for seed in 0..200_usize {
            let matrices: Vec<DMatrix<f64>> = (0..ABREAST)
                .map(|lane| {
                    let number = |i: usize, j: usize| {
                        let hash = (i * 37 + j * 101 + lane * 53 + seed * 7919) % 997;
                        hash as f64 / 997.0 - 0.5
                    };
                    // A product of orthonormal bases, near the identity or anything, some of low rank.
                    let spread = [1e-3, 0.1, 1.0, 10.0][lane % 4];
                    let a = DMatrix::from_fn(2 * N, N, |i, j| {
                        f64::from(u8::from(i == j)) + spread * number(i, j)
                    });
                    let b = DMatrix::from_fn(2 * N, N, |i, j| {
                        f64::from(u8::from(i == j)) + spread * number(j + 5, i)
                    });
                    let mut product = a.qr().q().transpose() * b.qr().q();
                    if lane % 5 == 4 {
                        product.column_mut(N - 1).fill(0.0);
                    }
                    product
                })
                .collect();
            let mut columns: Columns<N> = [[[0.0; ABREAST]; N]; N];
            for (lane, matrix) in matrices.iter().enumerate() {
                for (j, column) in columns.iter_mut().enumerate() {
                    for (i, value) in column.iter_mut().enumerate() {
                        value[lane] = matrix[(i, j)] as f32;
                    }
                }
            }
            let dims: Singles = std::array::from_fn(|lane| (N - usize::from(lane % 5 == 4)) as f32);
            let sums = squared_angles(&mut columns, &dims);
            for (lane, matrix) in matrices.iter().enumerate() {
                let expected = expected(matrix, dims[lane] as usize);
                let difference = (f64::from(sums[lane]) - expected).abs();
                assert!(difference < 5e-6, "{N} {seed} {lane}: {difference}");
            }
        }
    }

    #[test]
    fn angles_are_those_of_a_decomposition() {
        check::<1>();
        check::<2>();
        check::<3>();
        check::<6>();
    }

    #[test]
    fn angles_are_those_of_acos() {
        for index in 0..=10_000_u16 {
            let angle = f64::from(index) / 10_000.0 * f64::from(FRAC_PI_2);
            let squared = squared_angle(angle.cos().powi(2) as f32);
            assert!((f64::from(squared) - angle * angle).abs() < 1e-6, "{angle}");
        }
        assert_eq!(squared_angle(1.0 + 1e-6), 0.0);
    }

    #[test]
    fn tiny_and_zero_columns_stay_finite() {
        for value in [0.0, 1e-10, 1e-25, 1e-40] {
            let mut columns: Columns<3> = [[[value; ABREAST]; 3]; 3];
            let [sum, ..] = squared_angles(&mut columns, &[3.0; ABREAST]);
            let expected = 3.0 * FRAC_PI_2 * FRAC_PI_2;
            assert!((sum - expected).abs() < 1e-5, "{value}: {sum}");
        }
    }
}
