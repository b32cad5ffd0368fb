//! Evenly spaced coordinates along one axis of the integral image, found 16 at a time and without branches.

use crate::features::hog::channels::LANES;

/// A coordinate: the corner before it, and its distance from that corner, 0 to 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SampleCoord {
    pub corner: usize,
    pub fraction: f32,
}

/// Evenly spaced coordinates.
#[derive(Debug, Clone, Default)]
pub(crate) struct SampleCoords {
    corners: Vec<u32>,
    fractions: Vec<f32>,
}

/// Added to a number from 0 to 2^22, it leaves the nearest whole number in the last bits.
const ROUND: f32 = 8_388_608.0;
const WHOLE: u32 = (1 << 23) - 1;

impl SampleCoords {
    /// Makes room for `count` coordinates.
    pub fn resize(&mut self, count: usize) {
        self.corners.resize(count.next_multiple_of(LANES), 0);
        self.fractions.resize(count.next_multiple_of(LANES), 0.0);
    }

    /// Sets the coordinates to `start`, `start + step` and so on, clamped to 0 to `count`, which are the first and the
    /// last corner. NaN becomes 0.
    #[inline(always)]
    pub fn set(&mut self, start: f32, step: f32, count: usize) {
        let (edge, last) = (count as f32, (count - 1) as f32);
        let groups = self.corners.as_chunks_mut::<LANES>().0.iter_mut();
        let groups = groups.zip(self.fractions.as_chunks_mut::<LANES>().0);
        for (group, (corners, fractions)) in groups.enumerate() {
            for lane in 0..LANES {
                let value = clamped(start + (group * LANES + lane) as f32 * step, edge);
                // A coordinate at a corner has a fraction of 1 or of 0, which is the same point.
                let whole = clamped(value - 0.5, last) + ROUND;
                corners[lane] = whole.to_bits() & WHOLE;
                fractions[lane] = value - (whole - ROUND);
            }
        }
    }

    /// Coordinate `index`.
    #[inline(always)]
    pub fn get(&self, index: usize) -> SampleCoord {
        SampleCoord {
            corner: self.corners[index] as usize,
            fraction: self.fractions[index],
        }
    }
}

/// `value` clamped to 0 to `max`; 0 for NaN.
#[inline(always)]
fn clamped(value: f32, max: f32) -> f32 {
    let value = if value > 0.0 { value } else { 0.0 };
    if value < max { value } else { max }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_evenly_spaced_and_clamped() {
        let mut coords = SampleCoords::default();
        coords.resize(37);
        for (start, step, count) in [
            (0.0, 1.0, 40),
            (-7.3, 0.9, 20),
            (3.0, 0.5, 1),
            (2.5, 0.0, 9),
        ] {
            coords.set(start, step, count);
            for index in 0..37 {
                let expected = (start + index as f32 * step).clamp(0.0, count as f32);
                let found = coords.get(index);
                assert!(found.corner < count && (0.0..=1.0).contains(&found.fraction));
                assert!((found.corner as f32 + found.fraction - expected).abs() < 1e-5);
            }
        }
        for start in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
            coords.set(start, 1.0, 20);
            assert!(coords.get(3).corner < 20);
        }
    }
}
