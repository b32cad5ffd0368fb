//! Combinations, inner products and lengths of vectors that are kept as slices, one after the other.
//!
//! All of it is inlined: it becomes vector instructions where what calls it is compiled for them.

use pulp::{Arch, Simd, WithSimd};

/// Targets whose sums are in registers at a time, two registers of each.
const TILE: usize = 4;

/// [`add_combinations`], to be compiled for the instructions that this machine has.
struct AddCombinations<'a> {
    targets: &'a mut [f32],
    factor: f32,
    coefficients: &'a [f32],
    vectors: &'a [f32],
    len: usize,
}

impl WithSimd for AddCombinations<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            targets,
            factor,
            coefficients,
            vectors,
            len,
        } = self;
        combine(simd, targets, factor, coefficients, vectors, len);
    }
}

/// Adds to each of `targets` the combination of `vectors` that its row of `coefficients` says, times `factor`.
/// All vectors are of length `len`.
pub(crate) fn add_combinations(
    targets: &mut [f32],
    factor: f32,
    coefficients: &[f32],
    vectors: &[f32],
    len: usize,
) {
    Arch::new().dispatch(AddCombinations {
        targets,
        factor,
        coefficients,
        vectors,
        len,
    });
}

/// As [`add_combinations`], within what is compiled for this machine's instructions.
#[inline(always)]
pub(crate) fn combine<S: Simd>(
    simd: S,
    targets: &mut [f32],
    factor: f32,
    coefficients: &[f32],
    vectors: &[f32],
    len: usize,
) {
    combine_as::<S, false, false>(simd, targets, factor, coefficients, vectors, len);
}

/// As [`combine`], but the combinations take the place of whatever is in `targets`.
#[inline(always)]
pub(crate) fn become_combinations<S: Simd>(
    simd: S,
    targets: &mut [f32],
    coefficients: &[f32],
    vectors: &[f32],
    len: usize,
) {
    combine_as::<S, true, false>(simd, targets, 1.0, coefficients, vectors, len);
}

/// As [`become_combinations`], with coefficients that are a lower triangle and zeros.
#[inline(always)]
pub(crate) fn become_triangular<S: Simd>(
    simd: S,
    targets: &mut [f32],
    coefficients: &[f32],
    vectors: &[f32],
    len: usize,
) {
    combine_as::<S, true, true>(simd, targets, 1.0, coefficients, vectors, len);
}

#[inline(always)]
fn combine_as<S: Simd, const IS_NEW: bool, const IS_LOWER: bool>(
    simd: S,
    targets: &mut [f32],
    factor: f32,
    coefficients: &[f32],
    vectors: &[f32],
    len: usize,
) {
    let (count, terms) = (targets.len() / len, vectors.len() / len);
    if terms == 0 {
        if IS_NEW {
            targets.fill(0.0);
        }
        return;
    }
    let columns = 2 * S::F32_LANES;
    let whole = len - len % columns;
    let scale = simd.splat_f32s(factor);
    for column in (0..whole).step_by(columns) {
        for first in (0..count).step_by(TILE) {
            let used = if IS_LOWER {
                terms.min(first + TILE)
            } else {
                terms
            };
            let mut rows = [&coefficients[..0]; TILE];
            for (p, row) in rows.iter_mut().enumerate() {
                // A tile at the end has the last target more than once.
                *row = &coefficients[(first + p).min(count - 1) * terms..][..used];
            }
            let sums = tile(simd, rows, &vectors[column..], len);
            for (p, sums) in sums.iter().enumerate().take(count - first) {
                let target = &mut targets[(first + p) * len + column..][..columns];
                let (target, _) = S::as_mut_simd_f32s(target);
                for (target, sum) in target.iter_mut().zip(sums) {
                    *target = if IS_NEW {
                        simd.mul_f32s(*sum, scale)
                    } else {
                        simd.mul_add_e_f32s(*sum, scale, *target)
                    };
                }
            }
        }
    }
    if whole < len {
        let rows = coefficients.chunks_exact(terms);
        for (target, row) in targets.chunks_exact_mut(len).zip(rows) {
            if IS_NEW {
                target[whole..].fill(0.0);
            }
            for (vector, &coefficient) in vectors.chunks_exact(len).zip(row) {
                add(&mut target[whole..], factor * coefficient, &vector[whole..]);
            }
        }
    }
}

/// The combinations that `rows` say of the first two registers of each of `vectors`.
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

/// The inner product, within what is compiled for this machine's instructions: summed in several registers, so that no
/// addition waits for the last one.
#[inline(always)]
pub(crate) fn product<S: Simd>(simd: S, a: &[f32], b: &[f32]) -> f32 {
    let (a_lanes, a_rest) = S::as_simd_f32s(a);
    let (b_lanes, b_rest) = S::as_simd_f32s(b);
    let (a_groups, a_lanes) = a_lanes.as_chunks::<TILE>();
    let (b_groups, b_lanes) = b_lanes.as_chunks::<TILE>();
    let mut parts = [simd.splat_f32s(0.0); TILE];
    for (x, y) in a_groups.iter().zip(b_groups) {
        for i in 0..TILE {
            parts[i] = simd.mul_add_e_f32s(x[i], y[i], parts[i]);
        }
    }
    for (i, (x, y)) in a_lanes.iter().zip(b_lanes).enumerate() {
        parts[i] = simd.mul_add_e_f32s(*x, *y, parts[i]);
    }
    let mut sum = parts[0];
    for part in &parts[1..] {
        sum = simd.add_f32s(sum, *part);
    }
    let mut total = simd.reduce_sum_f32s(sum);
    for (x, y) in a_rest.iter().zip(b_rest) {
        total += x * y;
    }
    total
}

/// `target += factor * vector`.
#[inline(always)]
pub(crate) fn add(target: &mut [f32], factor: f32, vector: &[f32]) {
    for (target, value) in target.iter_mut().zip(vector) {
        *target += factor * value;
    }
}

/// Brings a vector to length 1; a vector of zeros stays.
#[inline(always)]
pub(crate) fn normalize(vector: &mut [f32]) {
    normalize_with(dot(vector, vector), vector);
}

/// As [`normalize`], a vector whose squared length is known.
#[inline(always)]
pub(crate) fn normalize_with(square: f32, vector: &mut [f32]) {
    let length = square.sqrt();
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
    fn combinations_and_products_are_those_of_loops() {
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
            let mut lower = coefficients.clone();
            for (at, coefficient) in lower.iter_mut().enumerate() {
                if at % terms > at / terms {
                    *coefficient = 0.0;
                }
            }
            for (coefficients, is_lower) in [(&coefficients, false), (&lower, true)] {
                let mut expected = vec![0.0; count * len];
                add_combinations(&mut expected, 1.0, coefficients, &vectors, len);
                let mut found = given.clone();
                if is_lower {
                    become_triangular(pulp::Scalar, &mut found, coefficients, &vectors, len);
                } else {
                    become_combinations(pulp::Scalar, &mut found, coefficients, &vectors, len);
                }
                for (expected, found) in expected.iter().zip(&found) {
                    assert!((expected - found).abs() < 1e-4);
                }
            }
            let (a, b) = (numbers(len, 4), numbers(len, 5));
            let plain: f32 = a.iter().zip(&b).map(|(x, y)| x * y).sum();
            assert!((dot(&a, &b) - plain).abs() < 1e-4);
            assert!((product(pulp::Scalar, &a, &b) - plain).abs() < 1e-4);
        }
    }
}
