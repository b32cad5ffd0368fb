//! The distance between affine subspaces (equations 4, 5 and 8).

use std::f64::consts::PI;

use nalgebra::{SimdPartialOrd, SimdValue};

use crate::grassmann::batch::Batch;
use crate::grassmann::inner_products::InnerProducts;
use crate::grassmann::{Lanes, principal_angles};
use crate::params::table::Params;

/// What the distance asks of an entry of the bag, besides inner products.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    /// ‖μₖ‖².
    pub mean_square: f64,
    /// The number of columns of Fₖ.
    pub dim: usize,
}

/// dist(Aᵢ, B\[k\]) (equation 4), in \[0, 1\]: of each candidate of a batch, and `entry`, the `k`-th.
#[inline(always)]
pub(crate) fn between<const M: usize, const N: usize>(
    batch: &Batch<M, N>,
    (k, entry): (usize, Entry),
    products: &InnerProducts,
    columns: usize,
    params: &Params,
) -> Lanes {
    // γ = 1 / D: the greatest squared distance of two patches is D.
    let (number, alpha, gamma) = (
        Lanes::splat,
        params.alpha,
        1.0 / params.feature_len() as f64,
    );
    // ‖μ - μₖ‖² (equation 5), where μ = V 1 / (P + 1); rounding can put it below 0.
    let mean_product = products.with_mean::<M>(k).sum() / number(columns as f64);
    let origins = batch.mean_square - number(2.0) * mean_product + number(entry.mean_square);
    // UᵀFₖ = (W S⁻¹)ᵀ VᵀFₖ.
    let bases = batch.coefficients.tr_mul(&products.with_basis(k));
    let dim = batch.dim.simd_min(number(entry.dim as f64));
    let angles = principal_angles::squared_norm(&bases, dim);
    let beta = number(4.0 / (PI * PI)) / dim.simd_max(number(1.0));
    number(alpha * gamma) * origins.simd_max(number(0.0)) + number(1.0 - alpha) * beta * angles
}
