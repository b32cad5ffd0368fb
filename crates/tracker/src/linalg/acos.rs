//! Principal angles from their cosines, several at a time.
//!
//! Equation 8 needs θ², and cos²θ is known. `acos` of its root loses half of the digits near θ = 0, where most angles
//! are, and is a call for each of some thousand angles a frame; this polynomial compiles to vector instructions.
//!
//! Own code: no crate vectorises it for the machine it runs on, and `acos` takes 4.5 times as long
//! (AVX-512; docs/laboratory/NEGATIVE_RESULTS.md).

use std::f64::consts::FRAC_PI_2;

/// The number of angles that are computed together.
pub(crate) const LANES: usize = 8;

/// arcsin²(√y) / y on [0, 1/2], lowest power first: the Chebyshev fit of degree 16, off by less than 3e-15 (mpmath's
/// `chebyfit(lambda y: asin(sqrt(y))**2 / y, [0, 0.5], 17)`).
const ARCSIN_SQUARED: [f64; 17] = [
    1.0000000000000013,
    0.3333333333316897,
    0.17777777809206494,
    0.11428569057796428,
    0.08127077910832252,
    0.06154564422718647,
    0.04906490037159441,
    0.035967403707872526,
    0.0628610436596994,
    -0.13890838896915622,
    0.7216203771144711,
    -2.119193964523319,
    4.814695317837718,
    -7.625577694170688,
    8.26281108401822,
    -5.433544883275,
    1.7084255909903134,
];

/// θ² in [0, π²/4] from cos²θ, which is clamped to [0, 1] against rounding.
#[inline(always)]
pub(crate) fn squared_angles(squared_cosines: &[f64; LANES]) -> [f64; LANES] {
    let mut angles = [0.0; LANES];
    for lane in 0..LANES {
        // `cosine`, `sine` and `smaller` are squares.
        let cosine = squared_cosines[lane].clamp(0.0, 1.0);
        let sine = 1.0 - cosine;
        let smaller = if cosine < sine { cosine } else { sine };
        let mut ratio = 0.0;
        for coefficient in ARCSIN_SQUARED.iter().rev() {
            ratio = ratio * smaller + coefficient;
        }
        let squared = ratio * smaller;
        // arccos x is arcsin √(1 - x²), and π/2 - arcsin x.
        let complement = FRAC_PI_2 - squared.sqrt();
        angles[lane] = if cosine < sine {
            complement * complement
        } else {
            squared
        };
    }
    angles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_acos() {
        for index in 0..=10_000 {
            let angle = f64::from(index) / 10_000.0 * FRAC_PI_2;
            let squared = squared_angles(&[angle.cos().powi(2); LANES]);
            assert!((squared[3] - angle * angle).abs() < 1e-13, "{angle}");
        }
        for (cosine, expected) in [(-1e-17, FRAC_PI_2 * FRAC_PI_2), (1.0 + 1e-15, 0.0)] {
            let [squared, ..] = squared_angles(&[cosine; LANES]);
            assert!((squared - expected).abs() < 1e-15);
        }
    }
}
