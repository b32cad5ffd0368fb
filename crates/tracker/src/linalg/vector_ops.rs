//! Inner products, sums and lengths of single vectors, each a slice.
//!
//! All of it is inlined, so that it is compiled for the vector instructions of its caller.

use pulp::Simd;

/// A squared length that is a difference of larger squares, and below this share of them, is rounding: it counts as 0.
pub(crate) const MIN_REMAINDER: f32 = 1e-6;

/// Adds the sum of `vectors`, each times its factor, to `sum`; all of one length.
#[inline(always)]
pub(crate) fn add_all<S: Simd, const N: usize>(
    simd: S,
    sum: &mut [f32],
    factors: [f32; N],
    vectors: [&[f32]; N],
) {
    let (lanes, rest) = S::as_mut_simd_f32s(sum);
    let (count, whole) = (lanes.len(), lanes.len() * S::F32_LANES);
    let mut splats = [simd.splat_f32s(0.0); N];
    let mut rows = [S::as_simd_f32s(vectors[0]).0; N];
    for i in 0..N {
        splats[i] = simd.splat_f32s(factors[i]);
        rows[i] = &S::as_simd_f32s(vectors[i]).0[..count];
        add(rest, factors[i], &vectors[i][whole..]);
    }
    for (k, sum) in lanes.iter_mut().enumerate() {
        let mut total = *sum;
        for i in 0..N {
            total = simd.mul_add_e_f32s(splats[i], rows[i][k], total);
        }
        *sum = total;
    }
}

/// The inner product, summed in sixteen parts so that the loop vectorises.
#[inline(always)]
pub(crate) fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut parts = [0.0_f32; 16];
    let (a_chunks, a_rest) = a.as_chunks::<16>();
    let (b_chunks, b_rest) = b.as_chunks::<16>();
    for (x, y) in a_chunks.iter().zip(b_chunks) {
        for lane in 0..16 {
            parts[lane] += x[lane] * y[lane];
        }
    }
    let rest = a_rest.iter().zip(b_rest).map(|(x, y)| x * y);
    parts.iter().sum::<f32>() + rest.sum::<f32>()
}

/// `target += factor * vector`.
#[inline(always)]
pub(crate) fn add(target: &mut [f32], factor: f32, vector: &[f32]) {
    for (target, value) in target.iter_mut().zip(vector) {
        *target += factor * value;
    }
}

/// The nearest number with 8 significant bits, for finite ones: its lower half is zeros, which compress well.
#[inline(always)]
pub(crate) fn to_bfloat16(value: f32) -> f32 {
    f32::from_bits(value.to_bits().wrapping_add(0x8000) & 0xFFFF_0000)
}

/// Scales a vector to length 1; a vector of zeros stays.
#[inline(always)]
pub(crate) fn normalize(vector: &mut [f32]) {
    let length = dot(vector, vector).sqrt();
    if length > 1e-9 {
        let scale = 1.0 / length;
        vector.iter_mut().for_each(|value| *value *= scale);
    }
}

#[cfg(test)]
mod tests {
    use super::super::numbers;
    use super::*;

    #[test]
    fn products_and_sums_are_those_of_loops() {
        for len in [1, 5, 32, 71, 640] {
            let (a, b) = (numbers(len, 4), numbers(len, 5));
            let plain: f32 = a.iter().zip(&b).map(|(x, y)| x * y).sum();
            assert!((dot(&a, &b) - plain).abs() < 1e-4);
            let mut sum = numbers(len, 6);
            add_all(pulp::Scalar, &mut sum, [0.5, -2.0], [&a, &b]);
            for (i, (found, given)) in sum.iter().zip(numbers::<f32>(len, 6)).enumerate() {
                assert!((found - (given + 0.5 * a[i] - 2.0 * b[i])).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn a_normalized_vector_has_length_1_and_zeros_stay() {
        let (mut vector, mut zeros) = (numbers(71, 7), [0.0; 71]);
        normalize(&mut vector);
        normalize(&mut zeros);
        assert!((dot(&vector, &vector) - 1.0).abs() < 1e-5);
        assert_eq!(zeros, [0.0; 71]);
    }
}
