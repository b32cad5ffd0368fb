//! Floating-point numbers of either precision in vector registers, and the sums of several registers at once.
//!
//! To add up the values of one register takes a shuffle and an addition for each halving, and all but the first work on
//! registers that are mostly empty. So a few registers are merged first: two become one of the sums of neighbours, in
//! turn of the one and of the other, until each 128 bits hold a part of every sum. A sum is made in the same order
//! wherever its register stands, so it is the same to the last bit.

use std::ops::{AddAssign, Mul};

use pulp::{Simd, bytemuck};

/// How many registers are merged: as many as 128 bits have values, at most.
pub(crate) const GROUP_SIZE: usize = 4;

/// A floating-point number of either precision.
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
    /// The sum of each of the first `GROUP_SIZE` registers, where [`can_sum_each`] says so.
    fn sum_each<S: Simd>(simd: S, registers: [Self::Lanes<S>; GROUP_SIZE]) -> [Self; GROUP_SIZE];
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
                registers: [S::$lanes; GROUP_SIZE],
            ) -> [Self; GROUP_SIZE] {
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
    // Pairs of neighbours move together from here on.
    let [even, odd] = simd.deinterleave_shfl_f64s([pair(a, b), pair(c, d)]);
    let sum = simd.add_f32s(bytemuck::cast(even), bytemuck::cast(odd));
    fold::<f32, 4>(bytemuck::cast_slice(&[sum]))
}

/// [`Element::sum_each`] in double precision: of two.
#[inline(always)]
fn sum_each_double<S: Simd>(simd: S, [a, b, ..]: [S::f64s; 4]) -> [f64; 4] {
    let [even, odd] = simd.deinterleave_shfl_f64s([a, b]);
    fold::<f64, 2>(bytemuck::cast_slice(&[simd.add_f64s(even, odd)]))
}

/// Whether the shuffles of these registers leave values where [`Element::sum_each`] expects them; pulp does not promise
/// it.
#[inline(always)]
pub(crate) fn can_sum_each<S: Simd, T: Element>(simd: S) -> bool {
    let count = T::count::<S>();
    if !count.is_multiple_of(T::GROUP_SIZE) {
        return false;
    }
    let mut registers = [T::splat(simd, T::default()); GROUP_SIZE];
    for (i, register) in registers.iter_mut().enumerate() {
        *register = T::splat(simd, T::from_index(1 << (4 * i)));
    }
    let sums = T::sum_each(simd, registers);
    let mut sums = sums.iter().zip(0..T::GROUP_SIZE);
    // A value of another register would change the sum: a register has 16 at most.
    sums.all(|(sum, i)| sum.to_index() == count << (4 * i))
}

/// The parts of 128 bits of a register, added up.
#[inline(always)]
fn fold<T: Element, const N: usize>(values: &[T]) -> [T; GROUP_SIZE] {
    let mut sums = [T::default(); GROUP_SIZE];
    for part in values.as_chunks::<N>().0 {
        for (sum, value) in sums.iter_mut().zip(part) {
            *sum += *value;
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::{Arch, WithSimd};

    struct Check;

    impl WithSimd for Check {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            check::<S, f32>(simd);
            check::<S, f64>(simd);
        }
    }

    fn check<S: Simd, T: Element + PartialEq + std::fmt::Debug>(simd: S) {
        if !can_sum_each::<S, T>(simd) {
            return;
        }
        let count = T::count::<S>();
        let value = |register: usize, lane: usize| T::from_index(register * register + 3 * lane);
        let values: Vec<T> = (0..GROUP_SIZE * count)
            .map(|at| value(at / count, at % count))
            .collect();
        let mut registers = [T::splat(simd, T::default()); GROUP_SIZE];
        registers.copy_from_slice(T::lanes::<S>(&values).0);
        let sums = T::sum_each(simd, registers);
        for (register, sum) in sums.iter().enumerate().take(T::GROUP_SIZE) {
            let mut expected = T::default();
            for lane in 0..count {
                expected += value(register, lane);
            }
            assert_eq!(*sum, expected);
        }
    }

    #[test]
    fn sums_are_those_of_their_registers() {
        Arch::new().dispatch(Check);
        Check.with_simd(pulp::Scalar);
        Check.with_simd(pulp::Scalar256b);
        #[cfg(target_arch = "x86_64")]
        {
            let simd = pulp::x86::V3::try_new();
            if let Some(simd) = simd {
                Simd::vectorize(simd, Check);
                assert!(can_sum_each::<_, f32>(simd) && can_sum_each::<_, f64>(simd));
            }
            if let Some(simd) = pulp::x86::V4::try_new() {
                assert!(can_sum_each::<_, f32>(simd) && can_sum_each::<_, f64>(simd));
            }
        }
    }
}
