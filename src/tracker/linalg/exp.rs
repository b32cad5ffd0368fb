//! The exponential of many numbers at once: a polynomial that compiles to vector instructions.
//!
//! Own code: no crate vectorises it for the machine it runs on, and `f64::exp` takes 4 times as long, 1 % of a step
//! (`cargo bench --bench tables -- kernels`, AVX-512).

use std::f64::consts::LOG2_E;

/// ln 2 in two parts, the first with so few digits that its product with a small integer is exact.
const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];
/// Added to a number below 2^51 it leaves the nearest integer in the last bits.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// Below this the result is 0, though f64 reaches to -708 and beyond.
const MIN_EXPONENT: f64 = -700.0;
/// 1 / k!, highest power first: the remainder is below 2e-16 for |x| ≤ ln 2 / 2.
const TAYLOR: [f64; 13] = [
    1.0 / 479_001_600.0,
    1.0 / 39_916_800.0,
    1.0 / 3_628_800.0,
    1.0 / 362_880.0,
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    0.5,
    1.0,
    1.0,
];

/// Replaces each of `values`, none above 700, by its exponential, to a few parts in 10^16. Inlined, so that it is
/// compiled for the vector instructions of its caller.
#[inline(always)]
pub(crate) fn exp(values: &mut [f64]) {
    let (groups, rest) = values.as_chunks_mut::<16>();
    for group in groups {
        *group = exp_each(*group);
    }
    for value in rest {
        [*value] = exp_each([*value]);
    }
}

#[inline(always)]
fn exp_each<const N: usize>(mut values: [f64; N]) -> [f64; N] {
    for value in &mut values {
        let x = *value;
        let bounded = if x > MIN_EXPONENT { x } else { MIN_EXPONENT };
        let shifted = bounded * LOG2_E + ROUND;
        let integer = shifted - ROUND;
        let remainder = bounded - integer * LN_2[0] - integer * LN_2[1];
        let mut power = 0.0;
        for coefficient in TAYLOR {
            power = power * remainder + coefficient;
        }
        // 2 to that integer: it goes into the exponent's bits.
        let scale = f64::from_bits((shifted.to_bits() << 52).wrapping_add(1.0_f64.to_bits()));
        *value = if x > MIN_EXPONENT { power * scale } else { 0.0 };
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponentials_are_those_of_the_library() {
        let exponents: Vec<f64> = (0..4001).map(|i| f64::from(i) * -0.17 + 3.0).collect();
        let mut found = exponents.clone();
        exp(&mut found);
        for (x, found) in exponents.iter().zip(&found) {
            let expected = if *x > MIN_EXPONENT { x.exp() } else { 0.0 };
            assert!(
                (found - expected).abs() <= 5e-16 * expected,
                "{x}: {found} {expected}"
            );
        }
        let mut ends = [0.0, -0.0, -1e-300, -1e9, f64::NEG_INFINITY];
        exp(&mut ends);
        assert_eq!(ends, [1.0, 1.0, 1.0, 0.0, 0.0]);
    }
}
