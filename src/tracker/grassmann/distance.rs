//! The distance between affine subspaces (equations 4, 5 and 8).

use std::f64::consts::PI;

use crate::tracker::grassmann::candidate::Candidate;
use crate::tracker::grassmann::inner_products::InnerProducts;
use crate::tracker::grassmann::principal_angles;
use crate::tracker::params::table::Params;

/// The weights of the distance's two parts.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Distance {
    alpha: f64,
    gamma: f64,
}

/// What the distance asks of an entry of the bag, besides inner products.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    /// ‖μₖ‖².
    pub mean_square: f64,
    /// The number of columns of Fₖ.
    pub dim: usize,
}

impl Distance {
    /// α as it is set, and γ = 1 / D.
    pub fn of(params: &Params) -> Self {
        Self {
            alpha: params.alpha,
            gamma: params.gamma(),
        }
    }

    /// dist(Aᵢ, B\[k\]) (equation 4), in \[0, 1\]: of `candidate`, the `i`-th, and `entry`, the `k`-th.
    pub fn between<const M: usize, const N: usize>(
        self,
        (i, candidate): (usize, &Candidate<M, N>),
        (k, entry): (usize, Entry),
        products: &InnerProducts,
        columns: usize,
    ) -> f64 {
        // ‖μ - μₖ‖² (equation 5), where μ = V 1 / (P + 1); rounding can put it below 0.
        let mean_product = products.with_mean::<M>(i, k).sum() / columns as f64;
        let origins = candidate.mean_square - 2.0 * mean_product + entry.mean_square;
        // UᵀFₖ = (W S⁻¹)ᵀ VᵀFₖ.
        let bases = candidate.coefficients.tr_mul(&products.with_basis(i, k));
        let dim = candidate.dim.min(entry.dim);
        let angles = principal_angles::squared_norm::<N>(&bases, dim);
        let beta = 4.0 / (dim.max(1) as f64 * PI * PI);
        self.alpha * self.gamma * origins.max(0.0) + (1.0 - self.alpha) * beta * angles
    }
}
