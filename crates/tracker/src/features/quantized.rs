//! Vectors in 4 or 10 bits a value, as the state keeps them.
//!
//! A session keeps more than a hundred feature vectors. Each has a scale of its own, so in 4 bits a value is off by at
//! most 1/14 of the vector's largest. Running means have 10 bits: a small step must change them.

use std::fmt;

use pulp::{Arch, Simd};
use serde::de::{DeserializeOwned, Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::linalg::fixed_point::{self, FromBits};

/// A quantised value.
pub(crate) trait Level:
    Copy + Default + FromBits + Into<f32> + Serialize + DeserializeOwned
{
    /// The largest value.
    const MAX: f32;
    /// Writes values to a snapshot.
    fn serialize_all<S: Serializer>(values: &[Self], serializer: S) -> Result<S::Ok, S::Error> {
        values.serialize(serializer)
    }
    /// Reads what [`serialize_all`](Self::serialize_all) writes.
    fn deserialize_all<'de, D: Deserializer<'de>>(source: D) -> Result<Vec<Self>, D::Error> {
        Vec::deserialize(source)
    }
}

/// Not a value: stands in the second half of the last byte where the number of values is odd.
const NONE: i8 = -8;

impl Level for i8 {
    const MAX: f32 = 7.0;
    /// Writes two values in a byte.
    fn serialize_all<S: Serializer>(values: &[i8], serializer: S) -> Result<S::Ok, S::Error> {
        // A pair is read as one number of 16 bits, so that the loop vectorises.
        let byte = |pair: [i8; 2]| {
            let pair = u16::from_le_bytes(pair.map(|value| value as u8));
            (pair & 0xF | pair >> 4 & 0xF0) as u8
        };
        let (pairs, rest) = values.as_chunks();
        let mut bytes: Vec<u8> = pairs.iter().map(|&pair| byte(pair)).collect();
        bytes.extend(rest.iter().map(|&last| byte([last, NONE])));
        // As one byte string; serde would write a vector element by element.
        serializer.serialize_bytes(&bytes)
    }
    fn deserialize_all<'de, D: Deserializer<'de>>(source: D) -> Result<Vec<i8>, D::Error> {
        source.deserialize_bytes(Pairs)
    }
}

/// Reads bytes that hold two values each.
struct Pairs;

impl Visitor<'_> for Pairs {
    type Value = Vec<i8>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("bytes of two values each")
    }

    fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Vec<i8>, E> {
        let mut values = vec![0; 2 * bytes.len()];
        for (pair, &byte) in values.as_chunks_mut().0.iter_mut().zip(bytes) {
            *pair = [(byte << 4) as i8 >> 4, byte as i8 >> 4];
        }
        values.pop_if(|last| *last == NONE);
        Ok(values)
    }
}

impl Level for i16 {
    const MAX: f32 = 511.0;
}

/// A vector: `scale` times whole numbers.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(bound = "T: Level")]
pub(crate) struct Quantized<T> {
    scale: f32,
    #[serde(
        serialize_with = "T::serialize_all",
        deserialize_with = "T::deserialize_all"
    )]
    values: Vec<T>,
}

/// A feature vector.
pub(crate) type QuantizedVector = Quantized<i8>;

#[pulp::with_simd(quantize = Arch::new())]
#[inline(always)]
fn quantize_simd<S: Simd, T: Level>(_: S, vector: &mut Quantized<T>, features: &[f32]) {
    vector.values.resize(features.len(), T::default());
    vector.scale = fixed_point::quantize(features, T::MAX, &mut vector.values);
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
            assert!((value - back).abs() <= 0.3 / 14.0 + 1e-6);
        }
        let mut without = vec![7.0; 100];
        vector.write(&features, &mut without);
        assert!(without.iter().all(|rest| rest.abs() <= 0.3 / 14.0 + 1e-6));
        let rounded: Vec<i8> = features
            .iter()
            .map(|v| (v / vector.scale).round() as i8)
            .collect();
        assert_eq!(vector.values, rounded);
        let mut finer = Quantized::<i16>::default();
        finer.set(&features);
        finer.write(&[], &mut back);
        for (value, back) in features.iter().zip(&back) {
            assert!((value - back).abs() <= 0.3 / 1022.0 + 1e-6);
        }
        vector.set(&[0.0; 3]);
        let mut zeros = vec![0.0; 3];
        vector.add_to(&mut zeros, 1.0);
        assert_eq!(zeros, [0.0; 3]);
    }
}
