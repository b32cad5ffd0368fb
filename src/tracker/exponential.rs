//! (D) e^x of many values at once, for likelihoods: in vector instructions where its caller is compiled for them.

/// How many values are worked on together.
const LANES: usize = 8;

/// Below this e^x is 0 here; no likelihood is told from 0 long before.
const LEAST: f64 = -700.0;

/// ln 2, and what of it double precision leaves out; the first has so many zeros at its end that its product with an
/// exponent is exact.
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];

/// 1.5 * 2^52: added to a small number, this rounds it to an integer, which the lowest bits are.
const ROUNDING: f64 = 6_755_399_441_055_744.0;

/// e^r on [-ln 2 / 2, ln 2 / 2], lowest power first: the Chebyshev fit of degree 12, off by less than 1e-19 (mpmath's
/// `chebyfit(exp, [-log(2) / 2, log(2) / 2], 13)`).
const POWERS: [f64; 13] = [
    1.0,
    0.9999999999999999985,
    0.4999999999999999999,
    0.1666666666666670241,
    0.04166666666666669219,
    0.008333333333309527079,
    0.001388888888887188822,
    0.0001984126990921710137,
    0.00002480158735011079562,
    2.755722495839262269e-6,
    2.755725190417491259e-7,
    2.511486952865776494e-8,
    2.092157996495030007e-9,
];

/// Replaces each of `values`, which are 0 or less, by e to its power.
#[inline(always)]
pub(super) fn of_negatives(values: &mut [f64]) {
    let (chunks, rest) = values.as_chunks_mut::<LANES>();
    for chunk in chunks {
        *chunk = exponentials(chunk);
    }
    let mut last = [0.0; LANES];
    last[..rest.len()].copy_from_slice(rest);
    rest.copy_from_slice(&exponentials(&last)[..rest.len()]);
}

#[inline(always)]
fn exponentials(values: &[f64; LANES]) -> [f64; LANES] {
    let mut results = [0.0; LANES];
    for lane in 0..LANES {
        let value = values[lane];
        let held = if value > LEAST { value } else { LEAST };
        let rounded = held * std::f64::consts::LOG2_E + ROUNDING;
        let power = rounded - ROUNDING;
        let rest = held - power * LN_2[0] - power * LN_2[1];
        let mut result = 0.0;
        for coefficient in POWERS.iter().rev() {
            result = result * rest + coefficient;
        }
        // The exponent's bits of 2^power.
        let scale = f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52);
        results[lane] = if value > LEAST { result * scale } else { 0.0 };
    }
    results
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponentials_are_those_of_the_library() {
        let mut values: Vec<f64> = (0..10_003).map(|i| f64::from(i) * -0.0699).collect();
        let expected: Vec<f64> = values.iter().map(|value| value.exp()).collect();
        of_negatives(&mut values);
        assert_eq!(values[0], 1.0);
        for (value, expected) in values.iter().zip(&expected) {
            assert!(
                (value - expected).abs() <= 1e-15 * expected,
                "{value} {expected}"
            );
        }
        let mut values = [0.0, -1e-300, -701.0, -1e300, f64::NEG_INFINITY];
        of_negatives(&mut values);
        assert_eq!(values, [1.0, 1.0, 0.0, 0.0, 0.0]);
    }
}
