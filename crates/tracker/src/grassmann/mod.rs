//! (D) The printed comparison (section III-D): how far each candidate's affine subspace is from each entry of the bag.
//!
//! A candidate is a feature vector v of D gray values in \[0, 1\]. With the P previous patches H it makes the
//! D × (P + 1) matrix V = [v, H] (equation 2). V is never decomposed: its Gram matrix VᵀV, of P + 1 rows, has the
//! eigenpairs (S², W), and the candidate's basis is U = V W S⁻¹. So all that the distances need is inner products:
//!
//! | step | what it makes | equation | file |
//! |---|---|---|---|
//! | inner products | VᵀV, and Vᵀμₖ and VᵀFₖ for each entry {μₖ, Fₖ} of the bag | | `inner_products` |
//! | the candidate's subspace | μ as its products, U as the coefficients W S⁻¹ | 1, 2 | `batch` |
//! | principal angles | θ from the singular values of UᵀFₖ, an n × n matrix | 6, 7 | `principal_angles` |
//! | distances | α γ ‖μ - μₖ‖² + (1 - α) β ‖Θ‖² | 4, 5, 8 | `distance` |
//! | likelihoods, weights | the sum rule over the bag | 9 to 12 | `weights` |
//!
//! **In:** N candidates and 1 to P previous patches, each of D values; K entries of up to n basis vectors each.
//! **Out:** N × K distances in \[0, 1\], for the sum rule. Nothing has a unit: gray values are shares of white.
//!
//! Candidates are compared in batches of eight. A `Lanes` is a number of each of them, so that an equation for one
//! candidate is one vector instruction for eight: one at a time, a frame takes 1.7 times as long.
//!
//! What can go wrong:
//! - *Precision.* The singular values of V count down to [`RANK_TOLERANCE`](crate::RANK_TOLERANCE) = 1e-5 of
//!   the largest, which is 1e-10 in the eigenvalues of VᵀV. Single precision has seven digits, so everything here is in
//!   double precision.
//! - *Rank.* V may have fewer than n directions (a black patch has none). U has as many columns as V has directions.
//!   Of two bases the smaller number of columns is the n of equation 8; without any column the origins alone decide.
//! - *Sizes.* Matrices here have fixed sizes, so that a frame allocates nothing:
//!   [`Evaluation`](evaluation::Evaluation) picks them by P and n, and what is beyond P + 1 and n is zero.

mod batch;
mod distance;
pub(crate) mod evaluation;
mod inner_products;
mod principal_angles;
pub(crate) mod subspace;

use crate::linalg::acos::LANES;

/// A number of each candidate of a batch.
type Lanes = simba::simd::AutoF64x8;
