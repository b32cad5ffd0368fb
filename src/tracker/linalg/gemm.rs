//! All inner products of two sets of vectors: most of the arithmetic of a frame.
//!
//! The sums of a tile of products are in vector registers, and vectors are read as they lie: nothing is packed, so no
//! room is needed. A few vectors of one set stay in the first cache while all of the other pass by.
//!
//! A product comes out the same wherever its vectors stand in their sets, so what is computed for one vector alone
//! and among others agrees to the last bit.

use std::ops::{AddAssign, Mul};

use pulp::{Arch, Simd, WithSimd, bytemuck};

use crate::tracker::linalg::reduce;

/// Tiles of the second set that stay in the cache: twelve vectors at most, of 640 single-precision values 31 KB.
const BLOCK: usize = 2;

/// Empties `values` so that the next `count` of them begin at a cache line: returns where that is. A load that
/// crosses two lines takes as long as two.
pub(crate) fn align<T: Copy + Default>(values: &mut Vec<T>, count: usize) -> usize {
    values.clear();
    values.reserve(most_before_line::<T>() + count);
    let first = first_at_line(values);
    values.resize(first, T::default());
    first
}

/// Makes `values` hold at least `count` of them, whatever they are, from a cache line on: returns where that is.
pub(crate) fn reserve_aligned<T: Copy + Default>(values: &mut Vec<T>, count: usize) -> usize {
    let most = most_before_line::<T>() + count;
    if values.len() < most {
        values.resize(most, T::default());
    }
    first_at_line(values)
}

const LINE: usize = 64;

fn most_before_line<T>() -> usize {
    LINE / size_of::<T>() - 1
}

fn first_at_line<T>(values: &[T]) -> usize {
    values
        .as_ptr()
        .align_offset(LINE)
        .min(most_before_line::<T>())
}

/// Numbers of either precision.
pub(crate) trait Element: Copy + Default + AddAssign + Mul<Output = Self> {
    /// A vector register of them.
    type Lanes<S: Simd>: Copy;
    /// Values as registers, and those left over.
    fn lanes<S: Simd>(values: &[Self]) -> (&[Self::Lanes<S>], &[Self]);
    /// A register of zeros.
    fn zeros<S: Simd>(simd: S) -> Self::Lanes<S>;
    /// `a * b + sum`.
    fn multiply_add<S: Simd>(
        simd: S,
        a: Self::Lanes<S>,
        b: Self::Lanes<S>,
        sum: Self::Lanes<S>,
    ) -> Self::Lanes<S>;
    /// How many values a register has.
    fn count<S: Simd>() -> usize;
    /// A register of one value.
    fn splat<S: Simd>(simd: S, value: Self) -> Self::Lanes<S>;
    /// The sum of a register.
    fn sum<S: Simd>(simd: S, lanes: Self::Lanes<S>) -> Self;
    /// How many registers are summed up together.
    const GROUP_SIZE: usize;
    /// The sum of each of the first `GROUP_SIZE` registers, where [`reduce::can_sum`] says so.
    fn sum_each<S: Simd>(
        simd: S,
        registers: [Self::Lanes<S>; reduce::GROUP_SIZE],
    ) -> [Self; reduce::GROUP_SIZE];
    /// A small number.
    fn from_index(index: usize) -> Self;
    /// The small number that this is.
    fn to_index(self) -> usize;
}

macro_rules! element {
    ($number:ty, $lanes:ident, $as_simd:ident, $splat:ident, $multiply_add:ident, $sum:ident,
        $together:literal, $sum_each:ident) => {
        impl Element for $number {
            type Lanes<S: Simd> = S::$lanes;

            const GROUP_SIZE: usize = $together;

            #[inline(always)]
            fn lanes<S: Simd>(values: &[Self]) -> (&[S::$lanes], &[Self]) {
                S::$as_simd(values)
            }

            #[inline(always)]
            fn zeros<S: Simd>(simd: S) -> S::$lanes {
                simd.$splat(0.0)
            }

            #[inline(always)]
            fn multiply_add<S: Simd>(
                simd: S,
                a: S::$lanes,
                b: S::$lanes,
                sum: S::$lanes,
            ) -> S::$lanes {
                simd.$multiply_add(a, b, sum)
            }

            #[inline(always)]
            fn count<S: Simd>() -> usize {
                size_of::<S::$lanes>() / size_of::<Self>()
            }

            #[inline(always)]
            fn splat<S: Simd>(simd: S, value: Self) -> S::$lanes {
                simd.$splat(value)
            }

            #[inline(always)]
            fn sum<S: Simd>(simd: S, lanes: S::$lanes) -> Self {
                simd.$sum(lanes)
            }

            #[inline(always)]
            fn sum_each<S: Simd>(
                simd: S,
                registers: [S::$lanes; reduce::GROUP_SIZE],
            ) -> [Self; reduce::GROUP_SIZE] {
                $sum_each(simd, registers)
            }

            #[inline(always)]
            fn from_index(index: usize) -> Self {
                index as Self
            }

            #[inline(always)]
            fn to_index(self) -> usize {
                self as usize
            }
        }
    };
}

element!(
    f32,
    f32s,
    as_simd_f32s,
    splat_f32s,
    mul_add_e_f32s,
    reduce_sum_f32s,
    4,
    sum_each_single
);
element!(
    f64,
    f64s,
    as_simd_f64s,
    splat_f64s,
    mul_add_e_f64s,
    reduce_sum_f64s,
    2,
    sum_each_double
);

/// [`Element::sum_each`] in single precision.
#[inline(always)]
fn sum_each_single<S: Simd>(simd: S, [a, b, c, d]: [S::f32s; 4]) -> [f32; 4] {
    let pair = |a, b| -> S::f64s {
        let [even, odd] = simd.deinterleave_shfl_f32s([a, b]);
        bytemuck::cast(simd.add_f32s(even, odd))
    };
    // Two neighbours, of the one and of the other, move together now.
    let [even, odd] = simd.deinterleave_shfl_f64s([pair(a, b), pair(c, d)]);
    let sum = simd.add_f32s(bytemuck::cast(even), bytemuck::cast(odd));
    reduce::fold::<f32, 4>(bytemuck::cast_slice(&[sum]))
}

/// [`Element::sum_each`] in double precision: of two.
#[inline(always)]
fn sum_each_double<S: Simd>(simd: S, [a, b, ..]: [S::f64s; 4]) -> [f64; 4] {
    let [even, odd] = simd.deinterleave_shfl_f64s([a, b]);
    reduce::fold::<f64, 2>(bytemuck::cast_slice(&[simd.add_f64s(even, odd)]))
}

/// [`inner_products`], to be compiled for the instructions that this machine has.
struct InnerProducts<'a, T> {
    a: &'a [T],
    b: &'a [T],
    len: usize,
    stride: usize,
    out: &'a mut [T],
}

impl<T: Element> WithSimd for InnerProducts<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        multiply(simd, self.a, self.b, self.len, self.stride, self.out);
    }
}

/// The inner products of each of the vectors `a` with each of the vectors `b`, all of length `len`: those of the
/// `i`-th of `a` from `out[i * stride]` on.
///
/// # Panics
/// If `out` is too short, or `stride` less than the number of vectors `b`.
pub(crate) fn inner_products<T: Element>(
    a: &[T],
    b: &[T],
    len: usize,
    stride: usize,
    out: &mut [T],
) {
    assert!(stride >= b.len() / len, "a place for each product");
    Arch::new().dispatch(InnerProducts {
        a,
        b,
        len,
        stride,
        out,
    });
}

/// As [`inner_products`], within what is compiled for this machine's instructions.
#[inline(always)]
pub(crate) fn multiply<S: Simd, T: Element>(
    simd: S,
    a: &[T],
    b: &[T],
    len: usize,
    stride: usize,
    out: &mut [T],
) {
    if S::REGISTER_COUNT >= 32 {
        multiply_tiles::<S, T, 6, 4>(simd, a, b, len, stride, out);
    } else {
        multiply_tiles::<S, T, 4, 3>(simd, a, b, len, stride, out);
    }
}

#[inline(always)]
fn multiply_tiles<S: Simd, T: Element, const A: usize, const B: usize>(
    simd: S,
    a: &[T],
    b: &[T],
    len: usize,
    stride: usize,
    out: &mut [T],
) {
    let (count_a, count_b) = (a.len() / len, b.len() / len);
    for block in (0..count_b).step_by(BLOCK * B) {
        let end = (block + BLOCK * B).min(count_b);
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
                    // A copy of a length that is not known would be a call.
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
) -> [[T; B]; A] {
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
        let mut at_b = [T::zeros(simd); B];
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
    let mut products = [[T::default(); B]; A];
    if reduce::can_sum::<S, T>(simd) {
        for first in (0..A * B).step_by(T::GROUP_SIZE) {
            let mut registers = [T::zeros(simd); reduce::GROUP_SIZE];
            for (i, register) in registers.iter_mut().enumerate().take(T::GROUP_SIZE) {
                // A group at the end has the last sum more than once.
                let at = (first + i).min(A * B - 1);
                *register = sums[at / B][at % B];
            }
            let totals = T::sum_each(simd, registers);
            for (i, total) in totals.iter().enumerate().take(T::GROUP_SIZE) {
                let at = (first + i).min(A * B - 1);
                products[at / B][at % B] = *total;
            }
        }
    } else {
        for at in 0..A * B {
            products[at / B][at % B] = T::sum(simd, sums[at / B][at % B]);
        }
    }
    for p in 0..A {
        let rest_a = T::lanes::<S>(a[p]).1;
        for q in 0..B {
            let rest_b = T::lanes::<S>(b[q]).1;
            for (&x, &y) in rest_a.iter().zip(rest_b) {
                products[p][q] += x * y;
            }
        }
    }
    products
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(count: usize, seed: usize) -> Vec<f64> {
        let number = |i: usize| ((i * 7919 + seed * 104_729) % 1000) as f64 / 500.0 - 1.0;
        (0..count).map(number).collect()
    }

    #[test]
    fn products_are_those_of_loops_in_both_precisions() {
        for (count_a, count_b, len) in [(1, 1, 5), (3, 2, 17), (7, 4, 64), (40, 21, 71), (2, 0, 8)]
        {
            let (a, b) = (numbers(count_a * len, 1), numbers(count_b * len, 2));
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

    #[test]
    fn a_product_does_not_depend_on_where_its_vectors_stand() {
        let len = 50;
        let (a, b) = (numbers(9 * len, 3), numbers(14 * len, 4));
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
