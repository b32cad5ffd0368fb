//! Sixteen candidates side by side: the same few operations are done for each of them, so each line of the code is one
//! or two vector instructions, and what one candidate would wait for (roots, divisions) is waited for together.

/// How many candidates are worked on together: a register of single-precision numbers where registers are longest.
pub(crate) const ABREAST: usize = 16;

/// A number of each of [`ABREAST`] candidates.
pub(crate) type Singles = [f32; ABREAST];

/// A number of each of [`ABREAST`] candidates, where single precision does not do.
pub(crate) type Doubles = [f64; ABREAST];

/// 1 / √(1 + x) for x in \[0, 1\], off by less than 1e-4 of it: where Newton's method begins. A root and a division would take
/// several times as long as this and a step of that.
#[inline(always)]
pub(crate) fn inverse_root(x: f32) -> f32 {
    // The Chebyshev fit of degree 4.
    const COEFFICIENTS: [f32; 5] = [
        0.999_927_04,
        -0.496_040_3,
        0.338_985_13,
        -0.186_642_67,
        0.050_930_7,
    ];
    let mut value = 0.0;
    for coefficient in COEFFICIENTS.iter().rev() {
        value = value * x + coefficient;
    }
    value
}
