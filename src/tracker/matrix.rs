//! Products of matrices that are kept as slices, one vector after the other, by way of nalgebra's fast kernel.

use nalgebra::{DMatrixView, DMatrixViewMut, Dyn, MatrixView};

/// Below this number of rows or columns nalgebra 0.35 takes another way, which reads past the end of a matrix whose
/// rows are contiguous.
const LEAST_SIDE: usize = 8;

/// `count` vectors of length `len` as the rows of a matrix.
fn rows(vectors: &[f32], count: usize, len: usize) -> MatrixView<'_, f32, Dyn, Dyn, Dyn, Dyn> {
    MatrixView::from_slice_with_strides_generic(vectors, Dyn(count), Dyn(len), Dyn(len), Dyn(1))
}

/// The inner products of each of the vectors `a` with each of the vectors `b`, all of length `len`: for each `a` those
/// with every `b`.
pub(super) fn inner_products(a: &[f32], b: &[f32], len: usize, out: &mut Vec<f32>) {
    let (count_a, count_b) = (a.len() / len, b.len() / len);
    out.resize(count_a * count_b, 0.0);
    if count_a.min(count_b).min(len) < LEAST_SIDE {
        let pairs = a
            .chunks_exact(len)
            .flat_map(|a| b.chunks_exact(len).map(move |b| (a, b)));
        for (out, (a, b)) in out.iter_mut().zip(pairs) {
            *out = dot(a, b);
        }
        return;
    }
    let b = rows(b, count_b, len);
    let a = DMatrixView::from_slice(a, len, count_a);
    DMatrixViewMut::from_slice(out, count_b, count_a).gemm(1.0, &b, &a, 0.0);
}

/// Adds to each of `targets` the combination of the vectors `b` that its row of `coefficients` says, times `factor`.
pub(super) fn add_combinations(
    targets: &mut [f32],
    factor: f32,
    coefficients: &[f32],
    b: &[f32],
    len: usize,
) {
    let (count, count_b) = (targets.len() / len, b.len() / len);
    if count == 0 || count_b == 0 {
        return;
    }
    let b = DMatrixView::from_slice(b, len, count_b);
    let coefficients = DMatrixView::from_slice(coefficients, count_b, count);
    DMatrixViewMut::from_slice(targets, len, count).gemm(factor, &b, &coefficients, 1.0);
}

/// The inner product, summed in sixteen parts so that the loop vectorises.
pub(super) fn dot(a: &[f32], b: &[f32]) -> f32 {
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
pub(super) fn add(target: &mut [f32], factor: f32, vector: &[f32]) {
    for (target, value) in target.iter_mut().zip(vector) {
        *target += factor * value;
    }
}

/// Brings a vector to length 1; a vector of zeros stays.
pub(super) fn normalize(vector: &mut [f32]) {
    let length = dot(vector, vector).sqrt();
    if length > 1e-9 {
        let scale = 1.0 / length;
        vector.iter_mut().for_each(|value| *value *= scale);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(count: usize, seed: usize) -> Vec<f32> {
        let number = |i: usize| ((i * 7919 + seed * 104_729) % 1000) as f32 / 500.0 - 1.0;
        (0..count).map(number).collect()
    }

    #[test]
    fn products_are_those_of_loops() {
        for (count_a, count_b, len) in [(1, 1, 5), (3, 2, 17), (40, 21, 64)] {
            let (a, b) = (numbers(count_a * len, 1), numbers(count_b * len, 2));
            let mut out = Vec::new();
            inner_products(&a, &b, len, &mut out);
            let mut sums = a.clone();
            add_combinations(&mut sums, -0.5, &out, &b, len);
            for i in 0..count_a {
                for j in 0..count_b {
                    let (a, b) = (&a[i * len..][..len], &b[j * len..][..len]);
                    let plain: f32 = a.iter().zip(b).map(|(x, y)| x * y).sum();
                    assert!((out[i * count_b + j] - plain).abs() < 1e-4);
                    assert!((dot(a, b) - plain).abs() < 1e-4);
                }
                for d in 0..len {
                    let combination = |j: usize| out[i * count_b + j] * b[j * len + d];
                    let sum: f32 = (0..count_b).map(combination).sum();
                    assert!((sums[i * len + d] - a[i * len + d] + 0.5 * sum).abs() < 1e-3);
                }
            }
        }
    }
}
