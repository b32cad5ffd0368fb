//! Numbers in vector registers: floating-point numbers of either precision, and whole numbers of 16 bits.

use std::any::Any;
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::__m256i;
use std::ops::AddAssign;

use pulp::Simd;
#[cfg(target_arch = "aarch64")]
use pulp::aarch64::Neon;
use pulp::bytemuck;
#[cfg(any(
    target_arch = "x86_64",
    target_arch = "aarch64",
    target_arch = "wasm32"
))]
use pulp::bytemuck::cast;
#[cfg(target_arch = "wasm32")]
use pulp::wasm::Simd128;
#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};

/// A number whose products are summed.
pub(crate) trait Element: Copy + Default {
    /// A vector register of such numbers.
    type Lanes<S: Simd>: Copy;
    /// A product or a sum of products.
    type Sum: Copy + Default + AddAssign;
    /// A vector register of sums.
    type Sums<S: Simd>: Copy;
    /// Whether one instruction multiplies and adds, so that the product needs no register of its own.
    const IS_FUSED: bool;
    /// The values as registers, and the values left over.
    fn lanes<S: Simd>(values: &[Self]) -> (&[Self::Lanes<S>], &[Self]);
    /// A register of zeros.
    fn zeros<S: Simd>(simd: S) -> Self::Sums<S>;
    /// The products of the lanes, added to `sums`: whole numbers two by two, since a sum has twice the bits.
    fn multiply_add<S: Simd>(
        simd: S,
        a: Self::Lanes<S>,
        b: Self::Lanes<S>,
        sums: Self::Sums<S>,
    ) -> Self::Sums<S>;
    /// The sum of each register; `B` is at most 4.
    fn sum<S: Simd, const A: usize, const B: usize>(
        simd: S,
        sums: [[Self::Sums<S>; B]; A],
    ) -> [[Self::Sum; B]; A];
    /// The product of two numbers.
    fn product(self, other: Self) -> Self::Sum;
}

macro_rules! element {
    ($number:ty: $lanes:ident $as_simd:ident $splat:ident $multiply_add:ident $sum:ident) => {
        impl Element for $number {
            type Lanes<S: Simd> = S::$lanes;
            type Sum = Self;
            type Sums<S: Simd> = S::$lanes;
            const IS_FUSED: bool = !cfg!(target_family = "wasm");

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
            fn sum<S: Simd, const A: usize, const B: usize>(
                simd: S,
                sums: [[S::$lanes; B]; A],
            ) -> [[Self; B]; A] {
                let mut totals = [[0.0; B]; A];
                for at in 0..A * B {
                    totals[at / B][at % B] = simd.$sum(sums[at / B][at % B]);
                }
                totals
            }

            #[inline(always)]
            fn product(self, other: Self) -> Self {
                self * other
            }
        }
    };
}

element!(f32: f32s as_simd_f32s splat_f32s mul_add_e_f32s reduce_sum_f32s);
element!(f64: f64s as_simd_f64s splat_f64s mul_add_e_f64s reduce_sum_f64s);

impl Element for i16 {
    type Lanes<S: Simd> = S::i16s;
    type Sum = i32;
    type Sums<S: Simd> = S::i32s;
    const IS_FUSED: bool = false;

    #[inline(always)]
    fn lanes<S: Simd>(values: &[Self]) -> (&[S::i16s], &[Self]) {
        let count = size_of::<S::i16s>() / size_of::<Self>();
        let (whole, rest) = values.split_at(values.len() / count * count);
        (bytemuck::cast_slice(whole), rest)
    }

    #[inline(always)]
    fn zeros<S: Simd>(_: S) -> S::i32s {
        bytemuck::Zeroable::zeroed()
    }

    #[inline(always)]
    fn multiply_add<S: Simd>(simd: S, a: S::i16s, b: S::i16s, sums: S::i32s) -> S::i32s {
        #[cfg(target_arch = "x86_64")]
        {
            if let Some(V4 {
                avx512f, avx512bw, ..
            }) = instructions(simd)
            {
                let products = avx512bw._mm512_madd_epi16(cast(a), cast(b));
                return cast(avx512f._mm512_add_epi32(products, cast(sums)));
            }
            if let Some(V3 { avx2, .. }) = instructions(simd) {
                let products = avx2._mm256_madd_epi16(cast(a), cast(b));
                return cast(avx2._mm256_add_epi32(products, cast(sums)));
            }
        }
        #[cfg(target_arch = "aarch64")]
        if let Some(Neon { neon }) = instructions(simd) {
            let (a, b) = (cast(a), cast(b));
            let (low_a, low_b) = (neon.vget_low_s16(a), neon.vget_low_s16(b));
            let sums = neon.vmlal_s16(cast(sums), low_a, low_b);
            return cast(neon.vmlal_high_s16(sums, a, b));
        }
        #[cfg(target_arch = "wasm32")]
        if let Some(Simd128 { simd128 }) = instructions(simd) {
            let products = simd128.i32x4_dot_i16x8(cast(a), cast(b));
            return cast(simd128.i32x4_add(products, cast(sums)));
        }
        let mut sums = sums;
        let totals: &mut [i32] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut sums));
        let (a, b) = (numbers::<_, Self>(&a), numbers::<_, Self>(&b));
        let parts = a.chunks(totals.len()).zip(b.chunks(totals.len()));
        for (a, b) in parts {
            for (total, (a, b)) in totals.iter_mut().zip(a.iter().zip(b)) {
                *total += a.product(*b);
            }
        }
        sums
    }

    #[inline(always)]
    fn sum<S: Simd, const A: usize, const B: usize>(
        simd: S,
        sums: [[S::i32s; B]; A],
    ) -> [[i32; B]; A] {
        let mut totals = [[0; B]; A];
        for row in 0..A {
            totals[row] = sum_row(simd, sums[row]);
        }
        totals
    }

    #[inline(always)]
    fn product(self, other: Self) -> i32 {
        i32::from(self) * i32::from(other)
    }
}

/// The instructions `T`, where `simd` stands for them.
#[inline(always)]
fn instructions<S: Simd, T: Copy + 'static>(simd: S) -> Option<T> {
    (&simd as &dyn Any).downcast_ref().copied()
}

/// The numbers of a register.
#[inline(always)]
fn numbers<L: bytemuck::Pod, T: bytemuck::Pod>(lanes: &L) -> &[T] {
    bytemuck::cast_slice(std::slice::from_ref(lanes))
}

/// The sum of each of at most four registers.
#[inline(always)]
fn sum_row<S: Simd, const N: usize>(simd: S, row: [S::i32s; N]) -> [i32; N] {
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(v4) = instructions::<S, V4>(simd) {
            let halves = row.map(|sums| {
                let [low, _]: [__m256i; 2] = cast(sums);
                let high = v4.avx512f._mm512_extracti64x4_epi64::<1>(cast(sums));
                v4.avx2._mm256_add_epi32(low, high)
            });
            return sums_of_eight(*v4, halves);
        }
        if let Some(v3) = instructions(simd) {
            return sums_of_eight(v3, row.map(cast));
        }
    }
    let _ = simd; // other instruction sets have no quicker way
    row.map(|sums| numbers::<_, i32>(&sums).iter().sum())
}

/// The sum of the eight numbers in each of at most four registers.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn sums_of_eight<const N: usize>(v3: V3, registers: [__m256i; N]) -> [i32; N] {
    let V3 {
        sse2, avx, avx2, ..
    } = v3;
    let at = |i: usize| registers[i.min(N - 1)];
    let (first, second) = (
        avx2._mm256_hadd_epi32(at(0), at(1)),
        avx2._mm256_hadd_epi32(at(2), at(3)),
    );
    let both = avx2._mm256_hadd_epi32(first, second);
    let (low, high) = (
        avx._mm256_castsi256_si128(both),
        avx2._mm256_extracti128_si256::<1>(both),
    );
    let sums: [i32; 4] = cast(sse2._mm_add_epi32(low, high));
    std::array::from_fn(|i| sums[i])
}
