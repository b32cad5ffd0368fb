//! The principal angles between two subspaces (equations 6 and 7).
//!
//! Their cosines are the singular values of EᵀF, so the squares of these are the eigenvalues of (EᵀF)ᵀ EᵀF. Squaring
//! costs half of the digits of double precision: a small cosine is off by up to 1e-8. There is one such matrix for each
//! candidate and entry, a thousand a frame: nalgebra's `singular_values` takes five times as long, and stops early
//! where singular values are small (dimforge/nalgebra issue 1172).

use nalgebra::SMatrix;

use crate::linalg::{acos, jacobi};

/// ‖Θ‖² (equation 6) of the `dim` smallest principal angles, in radians², of bases with these products EᵀF.
#[inline(always)]
pub(crate) fn squared_norm<const N: usize>(products: &SMatrix<f64, N, N>, dim: usize) -> f64 {
    let squared_cosines = jacobi::eigenvalues(products.tr_mul(products));
    let mut lanes = [0.0; acos::LANES];
    lanes[..N].copy_from_slice(squared_cosines.as_slice());
    acos::squared_angles(&lanes)[..dim].iter().sum()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Rotation3, Vector3};

    use super::*;

    #[test]
    fn the_cosines_of_known_angles_are_found_in_any_bases() {
        let turn =
            |axis: Vector3<f64>, angle: f64| Rotation3::new(axis.normalize() * angle).into_inner();
        let (left, right) = (
            turn(Vector3::new(1.0, 2.0, 3.0), 0.7),
            turn(Vector3::new(-2.0, 1.0, 0.5), 1.9),
        );
        for angles in [
            [0.0, 0.0, 0.0],
            [1e-6, 1e-3, 0.1],
            [0.3, 0.3, 1.2],
            [0.0, 1.56, 1.568],
            [0.5, 1.0, std::f64::consts::FRAC_PI_2],
        ] {
            let cosines = Vector3::from(angles.map(f64::cos));
            let product = left * Matrix3::from_diagonal(&cosines) * right;
            for dim in 0..=3 {
                let expected: f64 = angles[..dim].iter().map(|angle| angle * angle).sum();
                let found = squared_norm(&product, dim);
                assert!(
                    (found - expected).abs() < 1e-7,
                    "{angles:?}, {dim}: {found}"
                );
            }
        }
    }

    #[test]
    fn zero_columns_are_right_angles_and_tiny_ones_stay_finite() {
        for value in [0.0, 1e-30, 1e-160, 1e-300] {
            let product = SMatrix::<f64, 6, 6>::repeat(value);
            let found = squared_norm(&product, 6);
            let right = std::f64::consts::FRAC_PI_2.powi(2);
            assert!((found - 6.0 * right).abs() < 1e-7, "{value}: {found}");
        }
    }
}
