//! The sums of several vector registers at once.
//!
//! To add up the values of one register takes a shuffle and an addition for each halving, and all but the first of
//! them work on registers that are mostly empty. So a few registers are brought together first: two of them become one
//! of the sums of neighbours, in turn of the one and of the other, until each 128 bits hold a part of every sum.
//!
//! Each sum is made in the same order wherever its register stands among the others, so it is the same to the last bit.

use pulp::Simd;

use crate::tracker::linalg::gemm::Element;

/// How many registers are brought together: as many as 128 bits have values, at most.
pub(crate) const GROUP_SIZE: usize = 4;

/// Whether the shuffles of these registers leave values where [`sum_each`] takes them to be; the library does not say.
#[inline(always)]
pub(crate) fn can_sum<S: Simd, T: Element>(simd: S) -> bool {
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
    // A value of another register would show: there are 16 at most.
    sums.all(|(sum, i)| sum.to_index() == count << (4 * i))
}

/// The parts of 128 bits of a register, added up.
#[inline(always)]
pub(crate) fn fold<T: Element, const N: usize>(values: &[T]) -> [T; GROUP_SIZE] {
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
        if !can_sum::<S, T>(simd) {
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
                assert!(can_sum::<_, f32>(simd) && can_sum::<_, f64>(simd));
            }
            if let Some(simd) = pulp::x86::V4::try_new() {
                assert!(can_sum::<_, f32>(simd) && can_sum::<_, f64>(simd));
            }
        }
    }
}
