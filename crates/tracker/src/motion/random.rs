//! The draws of a frame: they come from a generator seeded with (seed, frame number), so no generator is part of the
//! state, and one frame given twice to the same state gives the same particles.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What draws are for: each purpose has a stream of its own.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Draws {
    /// The particles of a frame.
    Particles,
    /// Areas that the background and the discriminant learn from.
    Samples,
}

/// The generator of the draws of frame `frame`.
pub(crate) fn generator(seed: u64, frame: u64, draws: Draws) -> ChaCha8Rng {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    // Frame numbers stay far below the bit that tells the two apart.
    generator.set_stream(match draws {
        Draws::Particles => frame,
        Draws::Samples => frame | 1 << 63,
    });
    generator
}

/// A draw from the standard normal distribution.
pub(crate) fn normal(generator: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(generator)
}
