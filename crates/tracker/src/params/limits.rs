//! Limits on what several sizes cost together, so that no choice of parameters makes one session take more than some
//! fifty milliseconds a frame or keep more than a few megabytes.

use crate::params::table::{Params, ParamsError};

/// The greatest N, the number of particles.
const MAX_PARTICLES: usize = 1000;
/// Numbers in the feature vectors of one frame's candidates, at most: N · D.
const MAX_CANDIDATE_VALUES: usize = 1_100_000;
/// Numbers that a session keeps, at most: those of the full bag and of the background.
const MAX_KEPT_VALUES: usize = 1_000_000;
/// Multiplications with the background's samples in a frame, at most: those of all candidates and, in a frame that
/// refreshes the samples, those of all vectors that the bag is made of.
const MAX_BACKGROUND_PRODUCTS: usize = 110_000_000;

impl Params {
    /// The most particles with which these parameters would still be valid; they must be valid as they are. No search
    /// draws more particles.
    pub(crate) fn max_particles(&self) -> usize {
        let compared = MAX_BACKGROUND_PRODUCTS
            .checked_div(self.background_samples as usize * self.feature_len())
            .map_or(usize::MAX, |max| max - self.bag_vectors());
        MAX_PARTICLES
            .min(MAX_CANDIDATE_VALUES / self.feature_len())
            .min(compared)
    }

    /// The number of vectors that the entries of the full bag are made of.
    fn bag_vectors(&self) -> usize {
        self.bag_size as usize * (self.history as usize + 1)
    }

    /// Bytes that a session with these parameters keeps at most: the means and basis vectors of the bag, the
    /// background's samples, the vectors that the bag is made of, and a part that does not depend on the sizes. A value
    /// takes four bytes, or one where it is quantised.
    pub fn session_bytes(&self) -> usize {
        let vectors = self.bag_size as usize * (self.basis_dim as usize + 1);
        let kept = vectors + self.background_samples as usize;
        let bytes = if self.single_vector_candidate { 1 } else { 4 };
        (288 << 10) + self.feature_len() * (bytes * kept + self.bag_vectors())
    }

    /// Checks the products of sizes against their limits. Each size must be in its range, so that no product overflows.
    pub(crate) fn validate_products(&self) -> Result<(), ParamsError> {
        let len = self.feature_len();
        let (particles, samples) = (self.particles as usize, self.background_samples as usize);
        let kept = self.bag_size as usize * (self.basis_dim as usize + 1) + samples;
        let products = samples * (particles + self.bag_vectors()) * len;
        let limits = [
            (
                particles * len > MAX_CANDIDATE_VALUES,
                ("particles", self.particles),
                "fewer for patches of this size: particles times feature length is at most 1100000",
            ),
            (
                kept * len > MAX_KEPT_VALUES,
                ("bag_size", self.bag_size),
                "smaller for patches of this size: (bag_size times (basis_dim + 1) + background_samples) times feature \
                 length is at most 1000000",
            ),
            (
                products > MAX_BACKGROUND_PRODUCTS,
                ("background_samples", self.background_samples),
                "fewer for so much to compare: background_samples times (particles + bag_size times (history + 1)) \
                 times feature length is at most 110000000",
            ),
        ];
        match limits.into_iter().find(|(is_exceeded, ..)| *is_exceeded) {
            None => Ok(()),
            Some((_, (name, value), expected)) => Err(ParamsError {
                name,
                value: f64::from(value),
                expected,
            }),
        }
    }
}
