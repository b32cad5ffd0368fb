//! Linear combinations of vectors that are kept in one slice, one after the other.
//!
//! Own code: nalgebra's matrix product takes 1.8 times as long (AVX-512; docs/laboratory/NEGATIVE_RESULTS.md).

use pulp::Simd;

/// Targets whose sums are in registers at a time, two registers of each.
const TILE: usize = 4;

/// Adds to each of `targets` the combination of `vectors` whose coefficients are its row of `coefficients`, times
/// `factor`. All vectors are of length `len`.
#[pulp::with_simd(add_combinations = pulp::Arch::new())]
#[inline(always)]
pub(crate) fn combine<S: Simd>(
    simd: S,
    targets: &mut [f32],
    factor: f32,
    coefficients: &[f32],
    vectors: &[f32],
    len: usize,
) {
    let (count, terms) = (targets.len() / len, vectors.len() / len);
    if terms == 0 {
        return;
    }
    let columns = 2 * S::F32_LANES;
    let whole = len - len % columns;
    let scale = simd.splat_f32s(factor);
    for column in (0..whole).step_by(columns) {
        for first in (0..count).step_by(TILE) {
            // A tile at the end has the last target more than once.
            let rows: [&[f32]; TILE] = std::array::from_fn(|p| {
                &coefficients[(first + p).min(count - 1) * terms..][..terms]
            });
            let sums = tile(simd, rows, &vectors[column..], len);
            for (p, sums) in sums.iter().enumerate().take(count - first) {
                let target = &mut targets[(first + p) * len + column..][..columns];
                let (target, _) = S::as_mut_simd_f32s(target);
                for (target, sum) in target.iter_mut().zip(sums) {
                    *target = simd.mul_add_e_f32s(*sum, scale, *target);
                }
            }
        }
    }
    if whole < len {
        let rows = coefficients.chunks_exact(terms);
        for (target, row) in targets.chunks_exact_mut(len).zip(rows) {
            for (vector, coefficient) in vectors.chunks_exact(len).zip(row) {
                for (target, value) in target[whole..].iter_mut().zip(&vector[whole..]) {
                    *target += factor * coefficient * value;
                }
            }
        }
    }
}

/// As [`combine`] with the factor 1, but replaces what is in `targets`.
#[inline(always)]
pub(crate) fn assign_combinations<S: Simd>(
    simd: S,
    targets: &mut [f32],
    coefficients: &[f32],
    vectors: &[f32],
    len: usize,
) {
    targets.fill(0.0);
    combine(simd, targets, 1.0, coefficients, vectors, len);
}

/// The combinations with coefficients `rows` of the first two registers of each of `vectors`.
#[inline(always)]
fn tile<S: Simd>(
    simd: S,
    rows: [&[f32]; TILE],
    vectors: &[f32],
    len: usize,
) -> [[S::f32s; 2]; TILE] {
    let mut sums = [[simd.splat_f32s(0.0); 2]; TILE];
    for (k, _) in rows[0].iter().enumerate() {
        let (vector, _) = S::as_simd_f32s(&vectors[k * len..][..2 * S::F32_LANES]);
        for p in 0..TILE {
            let coefficient = simd.splat_f32s(rows[p][k]);
            sums[p][0] = simd.mul_add_e_f32s(coefficient, vector[0], sums[p][0]);
            sums[p][1] = simd.mul_add_e_f32s(coefficient, vector[1], sums[p][1]);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::super::numbers;
    use super::*;

    #[test]
    fn combinations_are_those_of_loops() {
        for (count, terms, len) in [(1, 1, 5), (3, 2, 32), (7, 9, 71), (40, 21, 64), (2, 0, 33)] {
            let (given, vectors) = (numbers(count * len, 1), numbers(terms * len, 2));
            let coefficients = numbers(count * terms, 3);
            let mut sums = given.clone();
            add_combinations(&mut sums, -0.5, &coefficients, &vectors, len);
            for i in 0..count {
                for d in 0..len {
                    let term = |j: usize| coefficients[i * terms + j] * vectors[j * len + d];
                    let sum: f32 = (0..terms).map(term).sum();
                    assert!((sums[i * len + d] - given[i * len + d] + 0.5 * sum).abs() < 1e-4);
                }
            }
            let mut expected = vec![0.0; count * len];
            add_combinations(&mut expected, 1.0, &coefficients, &vectors, len);
            let mut found = given.clone();
            assign_combinations(pulp::Scalar, &mut found, &coefficients, &vectors, len);
            for (expected, found) in expected.iter().zip(&found) {
                assert!((expected - found).abs() < 1e-4);
            }
        }
    }
}
