//! Where the corners of cells are among those of running sums: several at a time, without branches.

use crate::tracker::features::integral::LANES;

/// A coordinate among corners: the corner before it, and how far it is beyond that, 0 to 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SampleCoord {
    pub corner: usize,
    pub beyond: f32,
}

/// The places of evenly spaced coordinates.
#[derive(Debug, Clone, Default)]
pub(crate) struct SampleCoords {
    corners: Vec<u32>,
    beyond: Vec<f32>,
}

/// Added to a number from 0 to 2^22 it leaves the nearest whole number in the last bits.
const ROUND: f32 = 8_388_608.0;
const WHOLE: u32 = (1 << 23) - 1;

impl SampleCoords {
    /// Makes room for `count` places, in whole groups.
    pub fn prepare(&mut self, count: usize) {
        self.corners.resize(count.next_multiple_of(LANES), 0);
        self.beyond.resize(count.next_multiple_of(LANES), 0.0);
    }

    /// Takes the coordinates from `start` on, each `step` after the one before, along `count` pixels. Outside these there
    /// is nothing: their edge is as good.
    #[inline(always)]
    pub fn take(&mut self, start: f32, step: f32, count: usize) {
        let (edge, last) = (count as f32, (count - 1) as f32);
        let groups = self.corners.as_chunks_mut::<LANES>().0.iter_mut();
        let groups = groups.zip(self.beyond.as_chunks_mut::<LANES>().0);
        for (group, (corners, beyond)) in groups.enumerate() {
            for lane in 0..LANES {
                let value = start + (group * LANES + lane) as f32 * step;
                let value = bounded(value, edge);
                // At a corner it is the end of the one before or the beginning of the next, which is the same place.
                let whole = bounded(value - 0.5, last) + ROUND;
                corners[lane] = whole.to_bits() & WHOLE;
                beyond[lane] = value - (whole - ROUND);
            }
        }
    }

    /// The place of coordinate `index`.
    #[inline(always)]
    pub fn get(&self, index: usize) -> SampleCoord {
        SampleCoord {
            corner: self.corners[index] as usize,
            beyond: self.beyond[index],
        }
    }
}

/// `value`, no less than 0 and no more than `most`; what is not a number counts as 0.
#[inline(always)]
fn bounded(value: f32, most: f32) -> f32 {
    let value = if value > 0.0 { value } else { 0.0 };
    if value < most { value } else { most }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_where_their_coordinates_are() {
        let mut places = SampleCoords::default();
        places.prepare(37);
        for (start, step, count) in [
            (0.0, 1.0, 40),
            (-7.3, 0.9, 20),
            (3.0, 0.5, 1),
            (2.5, 0.0, 9),
        ] {
            places.take(start, step, count);
            for index in 0..37 {
                let expected = (start + index as f32 * step).clamp(0.0, count as f32);
                let place = places.get(index);
                assert!(place.corner < count && (0.0..=1.0).contains(&place.beyond));
                assert!((place.corner as f32 + place.beyond - expected).abs() < 1e-5);
            }
        }
        for start in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
            places.take(start, 1.0, 20);
            assert!(places.get(3).corner < 20);
        }
    }
}
