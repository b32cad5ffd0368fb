//! From distances to the weights of the particles (equations 9 to 12).
//!
//! - `likelihood`: the normalised likelihoods, the sum rule and the arg max, as printed.
//! - `posterior`: the weights of all particles of a frame: the sum rule times a prior for each particle.
//!
//! In: N x K distances in \[0, 1\], σ, and for each particle the logarithm of its prior. Out: N weights. Distances of
//! hundreds of σ do not underflow: equation 10 normalises over the candidates, so the minimum over the candidates may
//! be subtracted first.

pub(crate) mod likelihood;
pub(crate) mod posterior;
