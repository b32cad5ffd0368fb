//! All inner products of two sets of vectors: most of the arithmetic of a frame.
//!
//! The sums of a tile of products stay in vector registers, and the vectors are read where they lie: nothing is packed
//! or allocated. A few vectors of one set stay in the first-level cache while all of the other pass by. A product does
//! not depend on where its vectors stand in their sets, to the last bit.
//!
//! Own code: for the sizes of a step nalgebra's product takes 1.3 to 1.6 times as long, for eight vectors 3 times
//! (AVX-512; docs/laboratory/NEGATIVE_RESULTS.md). faer 0.24 takes 0.93 to 1.04 times as long in f32, for four
//! vectors 1.3 times; it is a large dependency for that, and it keeps a buffer of twice the L3 cache for each thread.

use pulp::Simd;

use super::element::Element;

/// Vectors of the second set, at most, that stay in the cache: eight of 768 single-precision values take 24 KB.
const BLOCK: usize = 8;

/// The inner products of each of the vectors `a` with each of the vectors `b`, all of length `len`: those of the
/// `i`-th of `a` from `out[i * stride]` on.
///
/// # Panics
/// If `out` is too short, or `stride` less than the number of vectors `b`.
#[pulp::with_simd(inner_products = pulp::Arch::new())]
#[inline(always)]
pub(crate) fn multiply<S: Simd, T: Element>(
    simd: S,
    a: &[T],
    b: &[T],
    len: usize,
    stride: usize,
    out: &mut [T::Sum],
) {
    assert!(stride >= b.len() / len, "a row of `out` holds all products");
    // In WebAssembly pulp counts 32 registers, but engines have a processor's 16, and keep two for themselves.
    if S::REGISTER_COUNT >= 32 && !cfg!(target_family = "wasm") {
        multiply_tiles::<S, T, 6, 4>(simd, a, b, len, stride, out);
    } else if T::IS_FUSED {
        multiply_tiles::<S, T, 4, 3>(simd, a, b, len, stride, out);
    } else {
        multiply_tiles::<S, T, 4, 2>(simd, a, b, len, stride, out);
    }
}

#[inline(always)]
fn multiply_tiles<S: Simd, T: Element, const A: usize, const B: usize>(
    simd: S,
    a: &[T],
    b: &[T],
    len: usize,
    stride: usize,
    out: &mut [T::Sum],
) {
    let (count_a, count_b) = (a.len() / len, b.len() / len);
    let block_len = BLOCK / B * B;
    for block in (0..count_b).step_by(block_len) {
        let end = (block + block_len).min(count_b);
        for i in (0..count_a).step_by(A) {
            let mut rows_a = [&a[..0]; A];
            for (p, row) in rows_a.iter_mut().enumerate() {
                // A tile at the end has the last vector more than once.
                *row = &a[(i + p).min(count_a - 1) * len..][..len];
            }
            for j in (block..end).step_by(B) {
                let mut rows_b = [&b[..0]; B];
                for (q, row) in rows_b.iter_mut().enumerate() {
                    *row = &b[(j + q).min(end - 1) * len..][..len];
                }
                let products = tile(simd, rows_a, rows_b);
                for (p, row) in products.iter().enumerate().take(count_a - i) {
                    let out = &mut out[(i + p) * stride + j..][..B.min(end - j)];
                    // Copying a number of values that is not known in advance would be a call.
                    match out.as_mut_array::<B>() {
                        Some(out) => *out = *row,
                        None => out.copy_from_slice(&row[..out.len()]),
                    }
                }
            }
        }
    }
}

/// The inner products of each of `a` with each of `b`, all of one length.
#[inline(always)]
pub(crate) fn tile<S: Simd, T: Element, const A: usize, const B: usize>(
    simd: S,
    a: [&[T]; A],
    b: [&[T]; B],
) -> [[T::Sum; B]; A] {
    let (first, _) = T::lanes::<S>(a[0]);
    let count = first.len();
    let mut lanes_a = [first; A];
    for (lanes, row) in lanes_a.iter_mut().zip(a) {
        *lanes = &T::lanes::<S>(row).0[..count];
    }
    let mut lanes_b = [first; B];
    for (lanes, row) in lanes_b.iter_mut().zip(b) {
        *lanes = &T::lanes::<S>(row).0[..count];
    }
    let mut sums = [[T::zeros(simd); B]; A];
    for k in 0..count {
        let mut at_b = [lanes_b[0][k]; B];
        for q in 0..B {
            at_b[q] = lanes_b[q][k];
        }
        for p in 0..A {
            let at_a = lanes_a[p][k];
            for q in 0..B {
                sums[p][q] = T::multiply_add(simd, at_a, at_b[q], sums[p][q]);
            }
        }
    }
    let mut products = T::sum(simd, sums);
    for p in 0..A {
        let rest_a = T::lanes::<S>(a[p]).1;
        for q in 0..B {
            let rest_b = T::lanes::<S>(b[q]).1;
            for (&x, &y) in rest_a.iter().zip(rest_b) {
                products[p][q] += x.product(y);
            }
        }
    }
    products
}

#[cfg(test)]
mod tests {
    use super::super::numbers;
    use super::*;

    #[test]
    fn products_are_those_of_loops_in_both_precisions() {
        for (count_a, count_b, len) in [(1, 1, 5), (3, 2, 17), (7, 4, 64), (40, 21, 71), (2, 0, 8)]
        {
            let (a, b) = (
                numbers::<f64>(count_a * len, 1),
                numbers::<f64>(count_b * len, 2),
            );
            let stride = count_b + 2;
            let mut out = vec![9.0; count_a * stride];
            inner_products(&a, &b, len, stride, &mut out);
            let single =
                |values: &[f64]| values.iter().map(|&value| value as f32).collect::<Vec<_>>();
            let mut out_single = vec![9.0; count_a * stride];
            inner_products(&single(&a), &single(&b), len, stride, &mut out_single);
            for i in 0..count_a {
                for j in 0..count_b {
                    let (a, b) = (&a[i * len..][..len], &b[j * len..][..len]);
                    let plain: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
                    assert!((out[i * stride + j] - plain).abs() < 1e-12);
                    assert!((f64::from(out_single[i * stride + j]) - plain).abs() < 1e-4);
                }
                assert_eq!(out[i * stride + count_b..][..2], [9.0; 2]);
            }
        }
    }

    /// With each kind of vector instructions that this machine has.
    #[test]
    fn products_of_whole_numbers_are_exact() {
        for (count_a, count_b, len) in [(1, 1, 5), (7, 5, 64), (40, 21, 71), (13, 9, 768)] {
            let whole = |count, seed| {
                let values = numbers::<f32>(count * len, seed).into_iter();
                values
                    .map(|value| (value * 1600.0) as i16)
                    .collect::<Vec<_>>()
            };
            let (a, b) = (whole(count_a, 1), whole(count_b, 2));
            let mut expected = Vec::new();
            for a in a.chunks(len) {
                let products = b.chunks(len).map(|b| {
                    let pairs = a.iter().zip(b);
                    pairs.map(|(&a, &b)| i32::from(a) * i32::from(b)).sum()
                });
                expected.extend(products.collect::<Vec<i32>>());
            }
            let mut out = vec![9; expected.len()];
            inner_products(&a, &b, len, count_b, &mut out);
            assert_eq!(out, expected);
            out.fill(9);
            multiply(pulp::Scalar::new(), &a, &b, len, count_b, &mut out);
            assert_eq!(out, expected);
            #[cfg(target_arch = "x86_64")]
            if let Some(v3) = pulp::x86::V3::try_new() {
                out.fill(9);
                v3.vectorize(|| multiply(v3, &a, &b, len, count_b, &mut out));
                assert_eq!(out, expected);
            }
        }
    }

    #[test]
    fn a_product_does_not_depend_on_where_its_vectors_stand() {
        let len = 50;
        let (a, b) = (numbers::<f64>(9 * len, 3), numbers::<f64>(14 * len, 4));
        let mut all = vec![0.0; 9 * 14];
        inner_products(&a, &b, len, 14, &mut all);
        for i in 0..9 {
            for j in 0..14 {
                let mut alone = [0.0];
                inner_products(
                    &a[i * len..][..len],
                    &b[j * len..][..len],
                    len,
                    1,
                    &mut alone,
                );
                assert_eq!(alone[0].to_bits(), all[i * 14 + j].to_bits());
            }
        }
    }
}
