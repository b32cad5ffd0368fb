//! (B) and (D) as printed (sections III-B and III-D): affine subspaces, and how far each candidate's is from each entry
//! of the bag. All of it is the paper's.
//!
//! A candidate is a feature vector v of D gray values in \[0, 1\]. With the P previous patches H it makes the
//! D × (P + 1) matrix V = [v, H] (equation 2). V is never decomposed: its Gram matrix VᵀV, of P + 1 rows, has the
//! eigenpairs (S², W), and the candidate's basis is U = V W S⁻¹. So all that the distances need is inner products:
//! VᵀV, and Vᵀμₖ and VᵀFₖ for each entry {μₖ, Fₖ} of the bag. They are one matrix product.
//!
//! | step | what it makes | equation | file |
//! |---|---|---|---|
//! | an entry of the bag | {μₖ, Fₖ} as vectors | 1, 2 | `subspace` |
//! | the candidate's subspace | μ as its products, U as the coefficients W S⁻¹ | 1, 2 | `evaluation` |
//! | principal angles | θ from the singular values of UᵀFₖ, an n × n matrix | 6, 7 | `principal_angles` |
//! | distances | α γ ‖μ - μₖ‖² + (1 - α) β ‖Θ‖² | 4, 5, 8 | `evaluation` |
//! | likelihoods, weights | the sum rule over the bag | 9 to 12 | `weights`, outside this module |
//!
//! **In:** N candidates and 1 to P previous patches, each of D values; K entries of up to n basis vectors each.
//! **Out:** N × K distances in \[0, 1\], for the sum rule. Nothing has a unit: gray values are shares of white.
//!
//! What can go wrong:
//! - *Precision.* The singular values of V count down to [`RANK_TOLERANCE`](crate::RANK_TOLERANCE) = 1e-5 of
//!   the largest, which is 1e-10 in the eigenvalues of VᵀV. Single precision has seven digits, so everything here is in
//!   double precision.
//! - *Rank.* V may have fewer than n directions (a black patch has none). U has as many columns as V has directions.
//!   Of two bases the smaller number of columns is the n of equation 8; without any column the origins alone decide.
//! - *Sizes.* Matrices have fixed sizes, so that a frame allocates nothing: what is beyond P + 1 and n is zero.

pub(crate) mod evaluation;
mod principal_angles;
pub(crate) mod subspace;
