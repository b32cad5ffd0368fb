//! From distances to the weights of the particles (equations 9 to 12).
//!
//! - `likelihood`: the normalised likelihoods, the sum rule with a prior for each particle, and the arg max.
//!
//! In: N x K distances in \[0, 1\], σ, and for each particle the logarithm of its prior. Out: N weights with the sum 1.
//! Distances of hundreds of σ do not underflow: equation 10 normalises over the candidates, so the minimum over the
//! candidates may be subtracted first. Where every product underflows all the same, the weights are equal.

pub(crate) mod likelihood;
