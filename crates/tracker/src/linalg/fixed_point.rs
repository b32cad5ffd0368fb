//! Vectors as whole numbers of 16 bits, each times a scale of its own: a register holds twice as many as in single
//! precision, and inner products of whole numbers are exact, so the same on all machines.

use pulp::{Arch, Simd};

use super::scratch::AlignedBuffer;
use super::{gemm, vector_ops};

/// Added to a number below 2^22, it leaves the nearest whole number in the last bits.
const ROUND: f32 = 12_582_912.0;

/// A whole number that is made of the last bits of a longer one.
pub(crate) trait FromBits {
    fn from_bits(bits: u32) -> Self;
}

impl FromBits for i8 {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        bits as i8
    }
}

impl FromBits for i16 {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        bits as i16
    }
}

/// Writes `vector` to `out` as whole numbers, the largest of which is `max` or -`max`. Returns the value of a step.
#[inline(always)]
pub(crate) fn quantize<T: FromBits>(vector: &[f32], max: f32, out: &mut [T]) -> f32 {
    let scale = largest(vector) / max;
    write(vector, scale, out);
    scale
}

/// The largest absolute value.
#[inline(always)]
fn largest(vector: &[f32]) -> f32 {
    // The bits of positive numbers are in their order, and the maximum of whole numbers vectorises.
    let magnitudes = vector.iter().map(|value| value.abs().to_bits());
    f32::from_bits(magnitudes.fold(0, u32::max))
}

/// Writes `vector` to `out` in steps of `scale`.
#[inline(always)]
fn write<T: FromBits>(vector: &[f32], scale: f32, out: &mut [T]) {
    let inverse = 1.0 / scale.max(f32::MIN_POSITIVE);
    for (out, value) in out.iter_mut().zip(vector) {
        *out = T::from_bits((value * inverse + ROUND).to_bits());
    }
}

/// The greatest length of a vector, in steps. Its square, which no inner product of two vectors exceeds, has 31 bits,
/// and leaves room for what rounding adds.
const MAX_LENGTH: f32 = 46_000.0;
/// The greatest magnitude of a value, in steps.
const MAX_VALUE: f32 = 32_000.0;

/// A set of vectors of one length D, in steps as fine as sums of 32 bits allow. With coarser steps, a difference in the
/// last bits, as there is in a browser, could become another box.
#[derive(Debug, Default)]
pub(crate) struct FixedPoint {
    values: AlignedBuffer<i16>,
    scales: Vec<f32>,
}

#[pulp::with_simd(set = Arch::new())]
#[inline(always)]
fn set_simd<S: Simd>(_: S, set: &mut FixedPoint, vectors: &[f32], len: usize) {
    set.values.resize(vectors.len());
    set.scales.clear();
    let rows = set.values.values_mut().chunks_exact_mut(len);
    for (row, vector) in rows.zip(vectors.chunks_exact(len)) {
        let length = vector_ops::dot(vector, vector).sqrt();
        let scale = (length / MAX_LENGTH).max(largest(vector) / MAX_VALUE);
        write(vector, scale, row);
        set.scales.push(scale);
    }
}

impl FixedPoint {
    /// Becomes `vectors`, each of length `len`.
    pub fn set(&mut self, vectors: &[f32], len: usize) {
        set(self, vectors, len);
    }

    /// The inner products of each vector with each of `others`, all of length `len`: those of vector `i` begin at
    /// `out[i * stride]`. Between the rows of products there are zeros. `sums` is scratch.
    #[inline(always)]
    pub fn inner_products<S: Simd>(
        &self,
        simd: S,
        others: &Self,
        len: usize,
        stride: usize,
        sums: &mut Vec<i32>,
        out: &mut Vec<f32>,
    ) {
        sums.resize(self.scales.len() * stride, 0);
        let (a, b) = (self.values.values(), others.values.values());
        multiply(simd, a, b, len, stride, sums);
        out.clear();
        for (row, scale) in sums.chunks_exact(stride).zip(&self.scales) {
            let products = row.iter().zip(&others.scales);
            out.extend(products.map(|(&sum, other)| scale * other * sum as f32));
            out.resize(out.len().next_multiple_of(stride), 0.0);
        }
    }
}

/// [`gemm::multiply`], with the instructions that AVX-512 has for sums of products where there are such.
#[inline(always)]
fn multiply<S: Simd>(simd: S, a: &[i16], b: &[i16], len: usize, stride: usize, out: &mut [i32]) {
    #[cfg(target_arch = "x86_64")]
    if let (Some(vnni), Some(v4)) = (Vnni::try_new(), pulp::x86::V4::try_new()) {
        vnni.vectorize(
            #[inline(always)]
            || gemm::multiply(v4, a, b, len, stride, out),
        );
        return;
    }
    gemm::multiply(simd, a, b, len, stride, out);
}

#[cfg(target_arch = "x86_64")]
pulp::simd_type!(
    /// The instructions of [`V4`](pulp::x86::V4), and those for sums of products of whole numbers.
    struct Vnni {
        sse: "sse",
        sse2: "sse2",
        fxsr: "fxsr",
        sse3: "sse3",
        ssse3: "ssse3",
        sse4_1: "sse4.1",
        sse4_2: "sse4.2",
        popcnt: "popcnt",
        avx: "avx",
        avx2: "avx2",
        bmi1: "bmi1",
        bmi2: "bmi2",
        fma: "fma",
        lzcnt: "lzcnt",
        avx512f: "avx512f",
        avx512bw: "avx512bw",
        avx512cd: "avx512cd",
        avx512dq: "avx512dq",
        avx512vl: "avx512vl",
        avx512vnni: "avx512vnni",
    }
);

#[cfg(test)]
mod tests {
    use super::super::numbers;
    use super::*;

    #[test]
    fn products_are_those_of_single_precision_to_three_digits() {
        for (count, others, len) in [(1, 1, 5), (3, 2, 17), (7, 4, 64), (40, 21, 71), (5, 9, 640)] {
            let (a, b) = (numbers::<f32>(count * len, 1), numbers(others * len, 2));
            let stride = others + 2;
            let [mut fixed_a, mut fixed_b] = [FixedPoint::default(), FixedPoint::default()];
            fixed_a.set(&a, len);
            fixed_b.set(&b, len);
            let mut out = vec![9.0];
            fixed_a.inner_products(
                pulp::Scalar::new(),
                &fixed_b,
                len,
                stride,
                &mut vec![7],
                &mut out,
            );
            assert_eq!(out.len(), count * stride);
            for (a, row) in a.chunks(len).zip(out.chunks(stride)) {
                for (b, product) in b.chunks(len).zip(row) {
                    let plain: f32 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                    assert!(
                        (plain - product).abs() < 1e-3 * len as f32,
                        "{plain} {product}"
                    );
                }
                assert_eq!(row[others..], [0.0; 2]);
            }
        }
    }
}
