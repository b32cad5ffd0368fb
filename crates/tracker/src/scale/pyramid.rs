//! The scale pyramid: areas around one centre, each a step larger than the one before, and their Fourier transform
//! along the scale. The areas show the box alone, since its rim shows the background.
//!
//! The transform is a product with a matrix of ten rows: for this length an FFT of each feature (realfft 3.5) takes ten
//! times as long.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use pulp::Simd;

use crate::features::extractor::Extractor;
use crate::image::frame::Frame;
use crate::linalg::{combinations, vector_ops};
use crate::motion::particles::{Particle, StateBounds};
use crate::params::table::Params;

/// Areas of a pyramid, and the logarithm of the ratio of two neighbouring sizes: from 1 / 1.27 to 1.27 times the
/// middle, several times what a target changes between frames.
pub(crate) const LEVELS: usize = 17;
pub(crate) const STEP: f64 = 0.03;
pub(crate) const MIDDLE: usize = LEVELS / 2;
/// The lowest frequencies, which make the filter: the others of a real signal of that length add less than a hundredth
/// to the response, since the desired response has next to nothing of those frequencies.
pub(crate) const FREQUENCIES: usize = 5;
/// Cells along a side of an area. Fewer describe the inside of a target too coarsely.
const CELLS: u32 = 8;
/// Standard deviation of the desired response, in levels.
pub(crate) const RESPONSE_STD: f64 = 1.2;

/// Buffers for one pyramid; nothing in them is kept for the next.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    pub areas: Vec<Particle>,
    /// The feature vectors of a pyramid, smallest area first.
    pub features: Vec<f32>,
    /// Their Fourier transform along the scale: for each frequency the real parts of all features, then the
    /// imaginary parts.
    pub spectrum: Vec<f32>,
    /// A row of the filter.
    pub row: Vec<f32>,
}

/// The parameters of a pyramid's features: the box alone, in cells of its own.
pub(crate) fn params(params: &Params) -> Params {
    Params {
        patch_width: CELLS,
        patch_height: CELLS,
        context: 1.0,
        // Colour tells little of the scale, and outweighs what does.
        chroma_weight: 0.0,
        ..params.clone()
    }
}

/// Writes the areas of the pyramid around `center` to `out`, smallest first.
fn areas(center: &Particle, out: &mut Vec<Particle>) {
    out.clear();
    out.extend((0..LEVELS).map(|level| Particle {
        scale: center.scale * (STEP * (level as f64 - MIDDLE as f64)).exp(),
        ..*center
    }));
}

/// The discrete Fourier transform along the scale.
pub(crate) struct Fourier {
    /// exp(-2πi k l / [`LEVELS`]) of frequency k and level l: real and imaginary part.
    pub twiddles: [[(f64, f64); LEVELS]; FREQUENCIES],
    /// For each frequency the real parts and then the imaginary parts, times the window: a row of coefficients each.
    windowed: Vec<f32>,
    /// G, for each frequency.
    pub desired: [(f64, f64); FREQUENCIES],
}

pub(crate) static FOURIER: LazyLock<Fourier> = LazyLock::new(|| {
    let twiddle = |frequency: usize, level: usize| {
        let angle = TAU * (frequency * level % LEVELS) as f64 / LEVELS as f64;
        (angle.cos(), -angle.sin())
    };
    let twiddles: [[_; LEVELS]; FREQUENCIES] =
        std::array::from_fn(|frequency| std::array::from_fn(|level| twiddle(frequency, level)));
    // A pyramid is not periodic: Hann's window fades out its ends.
    let window = |level: usize| {
        let along = TAU * (level + 1) as f64 / (LEVELS + 1) as f64;
        0.5 - 0.5 * along.cos()
    };
    let gaussian = |level: usize| {
        let off = (level as f64 - MIDDLE as f64) / RESPONSE_STD;
        (-0.5 * off * off).exp()
    };
    let mut windowed = Vec::with_capacity(2 * FREQUENCIES * LEVELS);
    for row in &twiddles {
        let values = || row.iter().enumerate();
        windowed.extend(values().map(|(level, twiddle)| (window(level) * twiddle.0) as f32));
        windowed.extend(values().map(|(level, twiddle)| (window(level) * twiddle.1) as f32));
    }
    let desired = twiddles.map(|row| {
        let terms = row.iter().enumerate();
        terms.fold((0.0, 0.0), |sum, (level, (real, imaginary))| {
            let value = gaussian(level);
            (sum.0 + value * real, sum.1 + value * imaginary)
        })
    });
    Fourier {
        twiddles,
        windowed,
        desired,
    }
});

impl Scratch {
    /// Takes the feature vectors of the pyramid around `center`.
    pub fn describe(
        &mut self,
        image: &Frame,
        center: &Particle,
        extractor: &mut Extractor,
        bounds: &StateBounds,
        tracker: &Params,
    ) {
        areas(center, &mut self.areas);
        let (areas, features) = (&self.areas, &mut self.features);
        extractor.features(image, areas, bounds, &params(tracker), features);
    }

    /// Scales the pyramid's vectors to length 1 and transforms them along the scale. Returns D.
    #[inline(always)]
    pub fn transform<S: Simd>(&mut self, simd: S) -> usize {
        let len = self.features.len() / LEVELS;
        self.features
            .chunks_exact_mut(len)
            .for_each(vector_ops::normalize);
        self.spectrum.resize(FREQUENCIES * 2 * len, 0.0);
        let spectrum = &mut self.spectrum;
        combinations::assign_combinations(simd, spectrum, &FOURIER.windowed, &self.features, len);
        len
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::extractor::PYRAMID_MARGIN;

    #[test]
    fn the_window_of_a_frame_holds_the_largest_level() {
        assert_eq!((STEP * MIDDLE as f64).exp(), PYRAMID_MARGIN);
    }
}
