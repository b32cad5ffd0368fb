//! How large the target is, once its place is known.
//!
//! Particles tell the scale poorly: areas a few hundredths larger or smaller look nearly alike, and the rim shows what is
//! behind the target, which grows as the camera nears it whatever the target does. So a *pyramid* is looked at, areas of
//! the box alone around the place found, each a step larger than the one before, and a correlation filter along the
//! scale says how far along it the target is (Danelljan, Häger, Khan and Felsberg, *Accurate Scale Estimation for
//! Robust Visual Tracking*, 2014):
//!
//! y = F⁻¹(Σ conj(Aᵢ) Zᵢ / (B + λ)),  Aᵢ ← (1 - η) Aᵢ + η conj(G) Fᵢ,  B ← (1 - η) B + η Σ |Fᵢ|²
//!
//! with the transforms along the scale Zᵢ and Fᵢ of feature i of the pyramid that is looked at and of the one that is
//! learned, and G that of the response that is wanted, a bell at the middle.
//!
//! The height of the response y tells how sure that is: 0.4 to 0.8 on a target in full sight, 0.2 and less where it is
//! covered, turned or missed. There the scale stays, or it would wander off within a few frames.

use pulp::{Arch, Simd, WithSimd};
use serde::{Deserialize, Serialize};

use crate::tracker::linalg::vector_ops;
use crate::tracker::params::table::Params;
use crate::tracker::scale::pyramid::{self, FREQUENCIES, LEVELS, MIDDLE, STEP, Scratch, WAVES};

/// λ, against energies of about 1: it only keeps flat pyramids from dividing by nothing.
const DAMPING: f32 = 0.01;
/// The greatest change of the logarithm of the scale in a frame: what is seen further off is mostly a neighbour.
const MAX_CHANGE: f64 = 0.06;
/// The share of a change that is taken, so that noise evens out.
const GAIN: f64 = 0.75;
/// Responses that say nothing, and that are believed whole.
const DOUBTFUL: f64 = 0.3;
const CERTAIN: f64 = 0.6;

/// The filter's state; without numbers it is off, or has not learned yet.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct ScaleFilter {
    /// A: for each frequency the real parts for all features, then the imaginary parts.
    numerators: Vec<f32>,
    /// B, for each frequency.
    energies: Vec<f32>,
}

/// What a pyramid says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Found {
    /// The logarithm of the scale against that of the pyramid's middle.
    pub change: f64,
    /// The height of the response there.
    pub response: f64,
}

/// [`ScaleFilter::learn`], to be compiled for the instructions that this machine has.
struct Learn<'a> {
    filter: &'a mut ScaleFilter,
    scratch: &'a mut Scratch,
    rate: f64,
}

impl WithSimd for Learn<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.filter.learn_all(simd, self.scratch, self.rate);
    }
}

/// [`ScaleFilter::respond`], to be compiled for the instructions that this machine has.
struct Respond<'a> {
    filter: &'a ScaleFilter,
    scratch: &'a mut Scratch,
}

impl WithSimd for Respond<'_> {
    type Output = [f64; LEVELS];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f64; LEVELS] {
        self.filter.respond_all(simd, self.scratch)
    }
}

impl ScaleFilter {
    /// Whether there is something to find by.
    pub fn has_learned(&self) -> bool {
        !self.energies.is_empty()
    }

    /// Forgets everything: the next pyramid is learned whole.
    pub fn forget(&mut self) {
        self.numerators.clear();
        self.energies.clear();
    }

    /// Learns the pyramid in `scratch`, whose middle is the target; `rate` is the share η of it.
    pub fn learn(&mut self, scratch: &mut Scratch, rate: f64) {
        Arch::new().dispatch(Learn {
            filter: self,
            scratch,
            rate,
        });
    }

    #[inline(always)]
    fn learn_all<S: Simd>(&mut self, simd: S, scratch: &mut Scratch, rate: f64) {
        let len = scratch.transform(simd);
        let rate = if self.has_learned() { rate as f32 } else { 1.0 };
        self.numerators.resize(FREQUENCIES * 2 * len, 0.0);
        self.energies.resize(FREQUENCIES, 0.0);
        let numerators = self.numerators.chunks_exact_mut(2 * len);
        let spectrum = scratch.spectrum.chunks_exact(2 * len);
        for (frequency, ((numerator, energy), parts)) in
            numerators.zip(&mut self.energies).zip(spectrum).enumerate()
        {
            let (real, imaginary) = parts.split_at(len);
            let total = vector_ops::product(simd, parts, parts);
            *energy += rate * (total - *energy);
            let (wanted_real, wanted_imaginary) = WAVES.wanted[frequency];
            let (cos, sin) = (wanted_real as f32 * rate, wanted_imaginary as f32 * rate);
            numerator.iter_mut().for_each(|value| *value *= 1.0 - rate);
            let (to_real, to_imaginary) = numerator.split_at_mut(len);
            vector_ops::add(to_real, cos, real);
            vector_ops::add(to_real, sin, imaginary);
            vector_ops::add(to_imaginary, cos, imaginary);
            vector_ops::add(to_imaginary, -sin, real);
        }
    }

    /// Where along the pyramid in `scratch` the target is.
    pub fn find(&self, scratch: &mut Scratch) -> Found {
        let response = self.respond(scratch);
        let mut best = 0;
        for (level, height) in response.iter().enumerate() {
            if *height > response[best] {
                best = level;
            }
        }
        let mut at = best as f64 - MIDDLE as f64;
        if (1..LEVELS - 1).contains(&best) {
            // The top of the parabola through three levels.
            let (left, right) = (response[best - 1], response[best + 1]);
            let bend = left - 2.0 * response[best] + right;
            if bend < 0.0 {
                at += (0.5 * (left - right) / bend).clamp(-0.5, 0.5);
            }
        }
        Found {
            change: STEP * at,
            response: response[best],
        }
    }

    fn respond(&self, scratch: &mut Scratch) -> [f64; LEVELS] {
        Arch::new().dispatch(Respond {
            filter: self,
            scratch,
        })
    }

    #[inline(always)]
    fn respond_all<S: Simd>(&self, simd: S, scratch: &mut Scratch) -> [f64; LEVELS] {
        let len = scratch.transform(simd);
        let mut spectrum = [(0.0, 0.0); FREQUENCIES];
        let numerators = self.numerators.chunks_exact(2 * len);
        let seen = scratch.spectrum.chunks_exact(2 * len);
        for (((product, numerator), seen), energy) in spectrum
            .iter_mut()
            .zip(numerators)
            .zip(seen)
            .zip(&self.energies)
        {
            let (real, imaginary) = numerator.split_at(len);
            let (seen_real, seen_imaginary) = seen.split_at(len);
            let energy = f64::from(energy + DAMPING);
            *product = (
                f64::from(vector_ops::product(simd, numerator, seen)) / energy,
                f64::from(
                    vector_ops::product(simd, real, seen_imaginary)
                        - vector_ops::product(simd, imaginary, seen_real),
                ) / energy,
            );
        }
        std::array::from_fn(|level| {
            let term = |(frequency, (real, imaginary)): (usize, &(f64, f64))| {
                let (cos, sin) = WAVES.turns[frequency][level];
                // All frequencies but 0 stand for their mirror image, too.
                let twice = if frequency == 0 { 1.0 } else { 2.0 };
                twice * (real * cos + imaginary * sin)
            };
            spectrum.iter().enumerate().map(term).sum::<f64>() / LEVELS as f64
        })
    }

    /// Whether this may be the filter of a tracker with `params`.
    pub fn is_valid_for(&self, params: &Params, greatest: f32) -> bool {
        let (numbers, energies) = if params.scale_learning_rate > 0.0 {
            let len = pyramid::params(params).feature_len();
            (FREQUENCIES * 2 * len, FREQUENCIES)
        } else {
            (0, 0)
        };
        self.numerators.len() == numbers
            && self.energies.len() == energies
            && self.numerators.iter().all(|value| value.abs() <= greatest)
            && self
                .energies
                .iter()
                .all(|energy| (0.0..=greatest).contains(energy))
    }
}

impl Found {
    /// The logarithm of how much larger the target is than the pyramid's middle, as far as that is certain.
    pub fn believed(&self) -> f64 {
        let certainty = (self.response - DOUBTFUL) / (CERTAIN - DOUBTFUL);
        let change = self.change.clamp(-MAX_CHANGE, MAX_CHANGE);
        GAIN * certainty.clamp(0.0, 1.0) * change
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::scale::pyramid::BELL;
    use std::f64::consts::TAU;

    const LEN: usize = 40;

    /// A pyramid of a smooth random picture whose target is `off` levels above the middle.
    fn pyramid(off: f64) -> Scratch {
        let value = |level: usize, i: usize| {
            let at = level as f64 - off;
            let phase = (i * i * 37 + i * 11) as f64;
            (1.2 + (0.25 * at * (1.0 + (i % 7) as f64 * 0.3) + phase).sin()) as f32
        };
        let features = (0..LEVELS).flat_map(|level| (0..LEN).map(move |i| value(level, i)));
        Scratch {
            features: features.collect(),
            ..Scratch::default()
        }
    }

    fn learned() -> ScaleFilter {
        let mut filter = ScaleFilter::default();
        filter.learn(&mut pyramid(0.0), 0.5);
        filter
    }

    #[test]
    fn the_response_is_that_of_the_printed_filter() {
        let filter = learned();
        let mut seen = pyramid(1.0);
        let found = filter.respond(&mut seen);
        // The same by definition, with complex sums over all frequencies.
        let mut learned = pyramid(0.0);
        learned.transform(pulp::Scalar);
        seen = pyramid(1.0);
        seen.transform(pulp::Scalar);
        let window =
            |level: usize| 0.5 - 0.5 * (TAU * (level + 1) as f64 / (LEVELS + 1) as f64).cos();
        let fourier = |signal: &dyn Fn(usize) -> f64, frequency: usize| {
            (0..LEVELS).fold((0.0, 0.0), |sum, level| {
                let angle = -TAU * (frequency * level) as f64 / LEVELS as f64;
                let value = signal(level);
                (sum.0 + value * angle.cos(), sum.1 + value * angle.sin())
            })
        };
        let bell = |level: usize| (-0.5 * ((level as f64 - 8.0) / BELL).powi(2)).exp();
        for (level, found) in found.iter().enumerate() {
            let mut expected = 0.0;
            for frequency in 0..LEVELS {
                let g = fourier(&bell, frequency);
                let (mut product, mut energy) = ((0.0, 0.0), f64::from(DAMPING));
                for i in 0..LEN {
                    let of = |scratch: &Scratch| {
                        let value = |level: usize| {
                            window(level) * f64::from(scratch.features[level * LEN + i])
                        };
                        fourier(&value, frequency)
                    };
                    let (f, z) = (of(&learned), of(&seen));
                    energy += f.0 * f.0 + f.1 * f.1;
                    // A = conj(G) F, and conj(A) Z.
                    let a = (g.0 * f.0 + g.1 * f.1, g.0 * f.1 - g.1 * f.0);
                    product.0 += a.0 * z.0 + a.1 * z.1;
                    product.1 += a.0 * z.1 - a.1 * z.0;
                }
                let angle = TAU * (frequency * level) as f64 / LEVELS as f64;
                expected += (product.0 * angle.cos() - product.1 * angle.sin()) / energy;
            }
            expected /= LEVELS as f64;
            assert!(
                (expected - found).abs() < 1e-4,
                "{level}: {expected} {found}"
            );
        }
    }

    #[test]
    fn a_target_that_grew_or_shrank_is_found_there() {
        let filter = learned();
        // The window draws what is found towards the middle.
        for off in [-2.0, -1.0, -0.4, 0.4, 1.0, 2.0] {
            let found = filter.find(&mut pyramid(off));
            let share = found.change / STEP / off;
            assert!((0.5..1.2).contains(&share), "{off}: {found:?}");
            assert!(found.response > CERTAIN, "{off}: {found:?}");
        }
    }

    #[test]
    fn what_was_never_seen_changes_nothing() {
        let filter = learned();
        let mut other = pyramid(0.0);
        for (i, value) in other.features.iter_mut().enumerate() {
            *value = ((i * i * 7919 + i * 104_729) % 1000) as f32 - 500.0;
        }
        let found = filter.find(&mut other);
        assert!(found.response < DOUBTFUL, "{found:?}");
        assert_eq!(found.believed(), 0.0);
    }

    #[test]
    fn flat_pyramids_leave_finite_numbers() {
        let mut filter = ScaleFilter::default();
        let mut flat = pyramid(0.0);
        flat.features.fill(0.0);
        filter.learn(&mut flat, 1.0);
        let found = filter.find(&mut flat);
        assert!(found.change.is_finite() && found.response == 0.0);
    }
}
