//! The scale filter of Danelljan, Häger, Khan and Felsberg, *Accurate Scale Estimation for Robust Visual Tracking*,
//! 2014.
//!
//! Particles estimate the scale poorly: areas a few percent larger or smaller look nearly alike, and their rim shows
//! the background, which grows as the camera approaches even if the target does not. A correlation filter along the
//! scale, over a pyramid of areas of the box alone, is more exact:
//!
//! y = F⁻¹(Σ conj(Aᵢ) Zᵢ / (B + λ)),  Aᵢ ← (1 - η) Aᵢ + η conj(G) Fᵢ,  B ← (1 - η) B + η Σ |Fᵢ|²
//!
//! with the Fourier transforms along the scale Zᵢ and Fᵢ of feature i of the pyramid that is searched and of the one
//! that is learned, and G that of the desired response, a Gaussian at the middle.

use pulp::{Arch, Simd};
use serde::{Deserialize, Serialize};

use crate::features::quantized::Quantized;
use crate::linalg::vector_ops;
use crate::params::table::Params;
use crate::scale::measure::Maximum;
use crate::scale::pyramid::{self, FOURIER, FREQUENCIES, LEVELS, MIDDLE, STEP, Scratch};
use crate::weights;

/// λ, against energies of about 1: it only keeps flat pyramids from a division by zero.
const LAMBDA: f32 = 0.01;
/// The filter's state: empty while it is off or has not learned yet.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct ScaleFilter {
    /// A: for each frequency the real parts of all features, then the imaginary parts.
    numerators: Vec<[Quantized<i16>; 2]>,
    /// B, for each frequency.
    energies: Vec<f32>,
}

impl ScaleFilter {
    /// Whether the filter can measure a scale.
    pub fn has_learned(&self) -> bool {
        !self.energies.is_empty()
    }

    /// Forgets everything: the next pyramid is learned with η = 1.
    pub fn reset(&mut self) {
        self.numerators.clear();
        self.energies.clear();
    }

    /// Measures the scale of the target in the pyramid in `scratch`.
    pub fn find(&self, scratch: &mut Scratch) -> Maximum {
        let response = respond(self, scratch);
        let best = weights::arg_max(&response);
        let mut at = best as f64 - MIDDLE as f64;
        if (1..LEVELS - 1).contains(&best) {
            // The vertex of the parabola through three levels.
            let (left, right) = (response[best - 1], response[best + 1]);
            let curvature = left - 2.0 * response[best] + right;
            if curvature < 0.0 {
                at += (0.5 * (left - right) / curvature).clamp(-0.5, 0.5);
            }
        }
        let change = STEP * at;
        let response = response[best];
        Maximum { change, response }
    }

    /// Whether this may be the filter of a tracker with `params`, all numbers at most `max` in size.
    pub fn is_valid_for(&self, params: &Params, max: f32) -> bool {
        let frequencies = if params.scale_learning_rate > 0.0 {
            FREQUENCIES
        } else {
            0
        };
        let len = pyramid::params(params).feature_len();
        let mut rows = self.numerators.as_flattened().iter();
        self.numerators.len() == frequencies
            && self.energies.len() == frequencies
            && rows.all(|row| row.is_valid_for(len, max))
            && self.energies.iter().all(|b| (0.0..=max).contains(b))
    }
}

/// Learns the pyramid in `scratch`, whose middle is the target, with the learning rate η.
#[pulp::with_simd(learn = Arch::new())]
#[inline(always)]
pub(crate) fn learn_simd<S: Simd>(
    simd: S,
    filter: &mut ScaleFilter,
    scratch: &mut Scratch,
    rate: f64,
) {
    let len = scratch.transform(simd);
    let rate = if filter.has_learned() {
        rate as f32
    } else {
        1.0
    };
    filter.numerators.resize_with(FREQUENCIES, Default::default);
    filter.energies.resize(FREQUENCIES, 0.0);
    let Scratch { spectrum, row, .. } = scratch;
    let spectrum = spectrum.chunks_exact(2 * len);
    let state = filter.numerators.iter_mut().zip(&mut filter.energies);
    for (((a, b), f), g) in state.zip(spectrum).zip(&FOURIER.desired) {
        *b += rate * (vector_ops::dot(f, f) - *b);
        let (g_real, g_imaginary) = (g.0 as f32 * rate, g.1 as f32 * rate);
        let (f_real, f_imaginary) = f.split_at(len);
        let terms = [
            [(g_real, f_real), (g_imaginary, f_imaginary)],
            [(g_real, f_imaginary), (-g_imaginary, f_real)],
        ];
        for (a, terms) in a.iter_mut().zip(terms) {
            row.clear();
            row.resize(len, 0.0);
            a.add_to(row, 1.0 - rate);
            for (factor, values) in terms {
                vector_ops::add(row, factor, values);
            }
            a.set(row);
        }
    }
}

/// The response y at each level.
#[pulp::with_simd(respond = Arch::new())]
#[inline(always)]
fn respond_simd<S: Simd>(simd: S, filter: &ScaleFilter, scratch: &mut Scratch) -> [f64; LEVELS] {
    let len = scratch.transform(simd);
    let Scratch { spectrum, row, .. } = scratch;
    row.resize(2 * len, 0.0);
    let mut quotients = [(0.0, 0.0); FREQUENCIES];
    let state = filter.numerators.iter().zip(&filter.energies);
    for ((quotient, (a, b)), z) in quotients
        .iter_mut()
        .zip(state)
        .zip(spectrum.chunks_exact(2 * len))
    {
        let (a_real, a_imaginary) = row.split_at_mut(len);
        a[0].write(&[], a_real);
        a[1].write(&[], a_imaginary);
        let (z_real, z_imaginary) = z.split_at(len);
        let real = vector_ops::dot(a_real, z_real) + vector_ops::dot(a_imaginary, z_imaginary);
        let imaginary = vector_ops::dot(a_real, z_imaginary) - vector_ops::dot(a_imaginary, z_real);
        let denominator = f64::from(b + LAMBDA);
        *quotient = (
            f64::from(real) / denominator,
            f64::from(imaginary) / denominator,
        );
    }
    std::array::from_fn(|level| {
        let term = |(frequency, (real, imaginary)): (usize, &(f64, f64))| {
            let (cos, minus_sin) = FOURIER.twiddles[frequency][level];
            // Each frequency but 0 stands for its negative too, whose term is the conjugate.
            let count = if frequency == 0 { 1.0 } else { 2.0 };
            count * (real * cos + imaginary * minus_sin)
        };
        quotients.iter().enumerate().map(term).sum::<f64>() / LEVELS as f64
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scale::measure::{FULL_RESPONSE, MIN_RESPONSE};
    use crate::scale::pyramid::RESPONSE_STD;
    use std::f64::consts::TAU;

    const LEN: usize = 40;

    /// The pyramid of a smooth random image whose target is `off` levels above the middle.
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
        learn(&mut filter, &mut pyramid(0.0), 0.5);
        filter
    }

    #[test]
    fn the_response_is_that_of_the_printed_filter() {
        let filter = learned();
        let mut seen = pyramid(1.0);
        let found = respond(&filter, &mut seen);
        // The response by its definition, with complex sums over the frequencies and their negatives.
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
        let gaussian = |level: usize| (-0.5 * ((level as f64 - 8.0) / RESPONSE_STD).powi(2)).exp();
        for (level, found) in found.iter().enumerate() {
            let mut expected = 0.0;
            let kept = |frequency: &usize| (*frequency).min(LEVELS - frequency) < FREQUENCIES;
            for frequency in (0..LEVELS).filter(kept) {
                let g = fourier(&gaussian, frequency);
                let (mut product, mut energy) = ((0.0, 0.0), f64::from(LAMBDA));
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
                (expected - found).abs() < 5e-4,
                "{level}: {expected} {found}"
            );
        }
    }

    #[test]
    fn a_target_that_grew_or_shrank_is_found_there() {
        let filter = learned();
        // The window pulls the maximum towards the middle.
        for off in [-2.0, -1.0, -0.4, 0.4, 1.0, 2.0] {
            let found = filter.find(&mut pyramid(off));
            let share = found.change / STEP / off;
            assert!((0.5..1.2).contains(&share), "{off}: {found:?}");
            assert!(found.response > FULL_RESPONSE, "{off}: {found:?}");
        }
    }

    #[test]
    fn an_unknown_image_changes_nothing() {
        let filter = learned();
        let mut other = pyramid(0.0);
        for (i, value) in other.features.iter_mut().enumerate() {
            *value = ((i * i * 7919 + i * 104_729) % 1000) as f32 - 500.0;
        }
        let found = filter.find(&mut other);
        assert!(found.response < MIN_RESPONSE, "{found:?}");
        assert_eq!(found.gated_change(), 0.0);
    }

    #[test]
    fn flat_pyramids_leave_finite_numbers() {
        let mut filter = ScaleFilter::default();
        let mut flat = pyramid(0.0);
        flat.features.fill(0.0);
        learn(&mut filter, &mut flat, 1.0);
        let found = filter.find(&mut flat);
        assert!(found.change.is_finite() && found.response == 0.0);
    }
}
