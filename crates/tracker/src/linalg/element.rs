//! Floating-point numbers of either precision in vector registers.

use std::ops::{AddAssign, Mul};

use pulp::Simd;

/// A floating-point number of either precision.
pub(crate) trait Element: Copy + Default + AddAssign + Mul<Output = Self> {
    /// A vector register of them.
    type Lanes<S: Simd>: Copy;
    /// Values as registers, and those left over.
    fn lanes<S: Simd>(values: &[Self]) -> (&[Self::Lanes<S>], &[Self]);
    /// A register of zeros.
    fn zeros<S: Simd>(simd: S) -> Self::Lanes<S>;
    /// `a * b + sum`, lane by lane.
    fn multiply_add<S: Simd>(
        simd: S,
        a: Self::Lanes<S>,
        b: Self::Lanes<S>,
        sum: Self::Lanes<S>,
    ) -> Self::Lanes<S>;
    /// The sum of a register.
    fn sum<S: Simd>(simd: S, lanes: Self::Lanes<S>) -> Self;
}

macro_rules! element {
    ($number:ty: $lanes:ident $as_simd:ident $splat:ident $multiply_add:ident $sum:ident) => {
        impl Element for $number {
            type Lanes<S: Simd> = S::$lanes;

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
            fn sum<S: Simd>(simd: S, lanes: S::$lanes) -> Self {
                simd.$sum(lanes)
            }
        }
    };
}

element!(f32: f32s as_simd_f32s splat_f32s mul_add_e_f32s reduce_sum_f32s);
element!(f64: f64s as_simd_f64s splat_f64s mul_add_e_f64s reduce_sum_f64s);
