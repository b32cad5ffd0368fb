//! Areas around one place, each a step larger than the one before, and their transform along the scale.
//!
//! For `scale`, which asks how far along it the target is. The areas show the box alone: its rim shows what is behind.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use pulp::Simd;

use crate::tracker::linalg::vector_ops;
use crate::tracker::motion::particles::Particle;
use crate::tracker::params::table::Params;

/// Areas of a pyramid, and the logarithm of the ratio of two neighbours: together a quarter up and down, several times
/// what a target changes between frames.
pub(crate) const LEVELS: usize = 17;
pub(crate) const STEP: f64 = 0.03;
pub(crate) const MIDDLE: usize = LEVELS / 2;
/// Frequencies of a real signal of that length.
pub(crate) const FREQUENCIES: usize = LEVELS / 2 + 1;
/// Cells along a side. With fewer, the insides of a target say too little.
const CELLS: u32 = 8;
/// Standard deviation of the wanted response, in levels.
pub(crate) const BELL: f64 = 1.2;

/// Room for pyramids; means nothing from one to the next.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    pub areas: Vec<Particle>,
    /// The feature vectors of a pyramid, smallest area first.
    pub features: Vec<f32>,
    /// Their transform along the scale: for each frequency the real parts for all features, then the imaginary parts.
    pub spectrum: Vec<f32>,
}

/// What a pyramid is looked at with: the box alone, in cells of its own.
pub(crate) fn params(params: &Params) -> Params {
    Params {
        patch_width: CELLS,
        patch_height: CELLS,
        context: 1.0,
        ..params.clone()
    }
}

/// Writes the areas of the pyramid around `center` to `out`, smallest first.
pub(crate) fn areas(center: &Particle, out: &mut Vec<Particle>) {
    out.clear();
    out.extend((0..LEVELS).map(|level| Particle {
        scale: center.scale * (STEP * (level as f64 - MIDDLE as f64)).exp(),
        ..*center
    }));
}

/// What does not depend on any pyramid.
pub(crate) struct Waves {
    /// cos and -sin of the angle that each frequency turns up to each level.
    pub turns: [[(f64, f64); LEVELS]; FREQUENCIES],
    /// For each frequency those cosines and then those sines, times the window: a row of coefficients each.
    windowed: Vec<f32>,
    /// G, for each frequency.
    pub wanted: [(f64, f64); FREQUENCIES],
}

pub(crate) static WAVES: LazyLock<Waves> = LazyLock::new(|| {
    let orientation = |frequency: usize, level: usize| {
        let angle = TAU * (frequency * level % LEVELS) as f64 / LEVELS as f64;
        (angle.cos(), -angle.sin())
    };
    let turns =
        std::array::from_fn(|frequency| std::array::from_fn(|level| orientation(frequency, level)));
    // The ends of a pyramid do not meet: Hann's window fades them out.
    let window = |level: usize| {
        let along = TAU * (level + 1) as f64 / (LEVELS + 1) as f64;
        0.5 - 0.5 * along.cos()
    };
    let bell = |level: usize| {
        let off = (level as f64 - MIDDLE as f64) / BELL;
        (-0.5 * off * off).exp()
    };
    let mut windowed = Vec::with_capacity(2 * FREQUENCIES * LEVELS);
    for row in &turns {
        let values = || row.iter().enumerate();
        windowed
            .extend(values().map(|(level, orientation)| (window(level) * orientation.0) as f32));
        windowed
            .extend(values().map(|(level, orientation)| (window(level) * orientation.1) as f32));
    }
    let wanted = turns.map(|row| {
        let terms = row.iter().enumerate();
        terms.fold((0.0, 0.0), |sum, (level, orientation)| {
            (
                sum.0 + bell(level) * orientation.0,
                sum.1 + bell(level) * orientation.1,
            )
        })
    });
    Waves {
        turns,
        windowed,
        wanted,
    }
});

impl Scratch {
    /// Brings the pyramid's vectors to length 1 and transforms them along the scale. Returns D.
    #[inline(always)]
    pub fn transform<S: Simd>(&mut self, simd: S) -> usize {
        let len = self.features.len() / LEVELS;
        for vector in self.features.chunks_exact_mut(len) {
            vector_ops::normalize_with(vector_ops::product(simd, vector, vector), vector);
        }
        self.spectrum.resize(FREQUENCIES * 2 * len, 0.0);
        let spectrum = &mut self.spectrum;
        vector_ops::become_combinations(simd, spectrum, &WAVES.windowed, &self.features, len);
        len
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::features::extractor::PYRAMID_MARGIN;

    #[test]
    fn the_window_of_a_frame_holds_the_largest_level() {
        assert_eq!((STEP * MIDDLE as f64).exp(), PYRAMID_MARGIN);
    }
}
