//! A feature vector as it is kept for later, in a byte a value.
//!
//! A session keeps more than a hundred of them: those the bag's subspaces were made of, and those of the background.
//! Each has its own scale, so the error of a value is at most 1/254 of the vector's greatest.

use pulp::{Arch, Simd, WithSimd};
use serde::{Deserialize, Serialize};

/// Added to a number below 2^22 it leaves the nearest whole number in the last bits.
const ROUND: f32 = 12_582_912.0;

/// A feature vector in a byte a value.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct QuantizedVector {
    /// What one step of a value is worth.
    scale: f32,
    values: Vec<i8>,
}

/// [`QuantizedVector::keep`], to be compiled for the instructions that this machine has.
struct Keep<'a> {
    look: &'a mut QuantizedVector,
    features: &'a [f32],
}

impl WithSimd for Keep<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.look.keep_all(self.features);
    }
}

impl QuantizedVector {
    /// Keeps `features` in place of what it kept.
    pub fn keep(&mut self, features: &[f32]) {
        Arch::new().dispatch(Keep {
            look: self,
            features,
        });
    }

    #[inline(always)]
    fn keep_all(&mut self, features: &[f32]) {
        // In parts so that the loop vectorises.
        let mut parts = [0.0_f32; 16];
        let (chunks, rest) = features.as_chunks::<16>();
        for chunk in chunks {
            for (most, value) in parts.iter_mut().zip(chunk) {
                let value = value.abs();
                *most = if value > *most { value } else { *most };
            }
        }
        let all = parts.iter().chain(rest);
        let greatest = all.fold(0.0_f32, |most, value| most.max(value.abs()));
        self.scale = greatest / 127.0;
        let inverse = if self.scale > 0.0 {
            1.0 / self.scale
        } else {
            0.0
        };
        self.values.resize(features.len(), 0);
        for (kept, value) in self.values.iter_mut().zip(features) {
            // None is further from 0 than 127.
            *kept = (value * inverse + ROUND).to_bits() as i8;
        }
    }

    /// Adds the features, times `factor`, to `target`.
    #[inline(always)]
    pub fn add_to(&self, target: &mut [f32], factor: f32) {
        let factor = factor * self.scale;
        for (target, &value) in target.iter_mut().zip(&self.values) {
            *target += factor * f32::from(value);
        }
    }

    /// Writes the features, with `mean` taken off, to `out`.
    #[inline(always)]
    pub fn write_without(&self, mean: &[f32], out: &mut [f32]) {
        for ((out, &value), mean) in out.iter_mut().zip(&self.values).zip(mean) {
            *out = self.scale * f32::from(value) - mean;
        }
    }

    /// Writes the features, with `mean` taken off if there is one, to `out`.
    #[inline(always)]
    pub fn write(&self, mean: &[f32], out: &mut [f32]) {
        if mean.is_empty() {
            out.fill(0.0);
            self.add_to(out, 1.0);
        } else {
            self.write_without(mean, out);
        }
    }

    /// Whether this may be a feature vector of length `len` with no value over `greatest`.
    pub fn is_valid_for(&self, len: usize, greatest: f32) -> bool {
        self.values.len() == len && (0.0..=greatest / 127.0).contains(&self.scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_look_comes_back_within_half_a_step() {
        let features: Vec<f32> = (0..100).map(|i| (i as f32 * 0.7).sin() * 0.3).collect();
        let mut look = QuantizedVector::default();
        look.keep(&features);
        let mut back = vec![0.0; 100];
        look.add_to(&mut back, 1.0);
        for (value, back) in features.iter().zip(&back) {
            assert!((value - back).abs() <= 0.3 / 254.0 + 1e-6);
        }
        let mut without = vec![7.0; 100];
        look.write_without(&features, &mut without);
        assert!(without.iter().all(|rest| rest.abs() <= 0.3 / 254.0 + 1e-6));
        let rounded: Vec<i8> = features
            .iter()
            .map(|v| (v / look.scale).round() as i8)
            .collect();
        assert_eq!(look.values, rounded);
        look.keep(&[0.0; 3]);
        let mut zeros = vec![0.0; 3];
        look.add_to(&mut zeros, 1.0);
        assert_eq!(zeros, [0.0; 3]);
    }
}
