//! Vectors in 8 or 14 bits a value, as the state keeps them.
//!
//! A session keeps more than a hundred feature vectors, of the bag's subspaces and of the background. Each has a scale
//! of its own, so a value is off by at most 1/254 of the vector's largest. Running means need more: a small step must
//! change them.

use pulp::{Arch, Simd};
use serde::{Deserialize, Serialize};

/// Added to a number below 2^22, it leaves the nearest whole number in the last bits.
const ROUND: f32 = 12_582_912.0;

/// A quantised value.
pub(crate) trait Level: Copy + Default + Into<f32> {
    /// The largest one.
    const MAX: f32;
    /// The number in the last bits.
    fn from_bits(bits: u32) -> Self;
}

impl Level for i8 {
    const MAX: f32 = 127.0;
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        bits as i8
    }
}

impl Level for i16 {
    /// Two bytes at most in a snapshot, whose whole numbers have seven bits a byte.
    const MAX: f32 = 8191.0;
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        bits as i16
    }
}

/// A vector: `scale` times whole numbers.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Quantized<T> {
    scale: f32,
    values: Vec<T>,
}

/// A feature vector.
pub(crate) type QuantizedVector = Quantized<i8>;

#[pulp::with_simd(quantize = Arch::new())]
#[inline(always)]
fn quantize_simd<S: Simd, T: Level>(_: S, vector: &mut Quantized<T>, features: &[f32]) {
    // Sixteen maxima, so that the loop vectorises.
    let mut maxima = [0.0_f32; 16];
    let (chunks, rest) = features.as_chunks::<16>();
    for chunk in chunks {
        for (max, value) in maxima.iter_mut().zip(chunk) {
            let value = value.abs();
            *max = if value > *max { value } else { *max };
        }
    }
    let all = maxima.iter().chain(rest);
    vector.scale = all.fold(0.0_f32, |max, value| max.max(value.abs())) / T::MAX;
    let inverse = if vector.scale > 0.0 {
        1.0 / vector.scale
    } else {
        0.0
    };
    vector.values.resize(features.len(), T::default());
    for (quantized, value) in vector.values.iter_mut().zip(features) {
        *quantized = T::from_bits((value * inverse + ROUND).to_bits());
    }
}

impl<T: Level> Quantized<T> {
    /// Quantises `features` in place of the vector that was there.
    pub fn set(&mut self, features: &[f32]) {
        quantize(self, features);
    }

    /// Adds `factor` times the vector to `target`.
    #[inline(always)]
    pub fn add_to(&self, target: &mut [f32], factor: f32) {
        let factor = factor * self.scale;
        for (target, &value) in target.iter_mut().zip(&self.values) {
            *target += factor * value.into();
        }
    }

    /// Writes the vector minus `mean` to `out`; the vector itself where `mean` is empty.
    #[inline(always)]
    pub fn write(&self, mean: &[f32], out: &mut [f32]) {
        if mean.is_empty() {
            out.fill(0.0);
            self.add_to(out, 1.0);
            return;
        }
        for ((out, &value), mean) in out.iter_mut().zip(&self.values).zip(mean) {
            *out = self.scale * value.into() - mean;
        }
    }

    /// Whether this is a feature vector of length `len` with no absolute value above `max`.
    pub fn is_valid_for(&self, len: usize, max: f32) -> bool {
        self.values.len() == len && (0.0..=max / T::MAX).contains(&self.scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vector_comes_back_within_half_a_step() {
        let features: Vec<f32> = (0..100).map(|i| (i as f32 * 0.7).sin() * 0.3).collect();
        let mut vector = QuantizedVector::default();
        vector.set(&features);
        let mut back = vec![0.0; 100];
        vector.add_to(&mut back, 1.0);
        for (value, back) in features.iter().zip(&back) {
            assert!((value - back).abs() <= 0.3 / 254.0 + 1e-6);
        }
        let mut without = vec![7.0; 100];
        vector.write(&features, &mut without);
        assert!(without.iter().all(|rest| rest.abs() <= 0.3 / 254.0 + 1e-6));
        let rounded: Vec<i8> = features
            .iter()
            .map(|v| (v / vector.scale).round() as i8)
            .collect();
        assert_eq!(vector.values, rounded);
        let mut finer = Quantized::<i16>::default();
        finer.set(&features);
        finer.write(&[], &mut back);
        for (value, back) in features.iter().zip(&back) {
            assert!((value - back).abs() <= 0.3 / 16_382.0 + 1e-6);
        }
        vector.set(&[0.0; 3]);
        let mut zeros = vec![0.0; 3];
        vector.add_to(&mut zeros, 1.0);
        assert_eq!(zeros, [0.0; 3]);
    }
}
