//! Rows of pixels along a straight line through a frame, by bilinear interpolation.
//!
//! Coordinates are fixed-point numbers with 16 fractional bits, and weights have 8 bits: whole numbers are faster than
//! floating-point ones here, and exact enough for 8-bit pixels. Beyond the edge the edge's pixel counts.

use std::ops::Range;

use crate::tracker::image::plane::Plane;

/// Fractional bits of a coordinate.
const FRACTION_BITS: u32 = 16;
/// The sum of the two weights along an axis.
const WEIGHT_SUM: u32 = 256;
/// Pixels that are interpolated together.
const GROUP_SIZE: usize = 16;

/// The coordinates of a row's samples along one axis, evenly spaced, as fixed-point numbers. 0 is the centre of the
/// first pixel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Axis {
    start: i32,
    step: i32,
    /// The last pixel of the frame along this axis, at least 1.
    last: i32,
}

impl Axis {
    /// Samples from `start` on, each `step` (pixels) after the one before. The frame has `len` pixels along this axis,
    /// at least 2. The step is at most 1, and `start` and the last sample are within 16,000 pixels of 0.
    #[inline(always)]
    pub fn new(start: f64, step: f64, len: u32) -> Self {
        let fixed = |value: f64| (value * f64::from(1_u32 << FRACTION_BITS)).round() as i32;
        Self {
            start: fixed(start),
            step: fixed(step),
            last: len as i32 - 1,
        }
    }

    #[inline(always)]
    fn at(&self, index: usize) -> i32 {
        self.start + index as i32 * self.step
    }

    #[inline(always)]
    fn group(&self, first: usize) -> [i32; GROUP_SIZE] {
        std::array::from_fn(|i| self.at(first + i))
    }

    /// The samples of `range` that are at or after the first pixel and before the last one.
    #[inline(always)]
    fn inside(&self, range: Range<usize>) -> Range<usize> {
        let (start, limit) = (self.start, self.last << FRACTION_BITS);
        let (first, end) = match self.step {
            0 if (0..limit).contains(&start) => return range,
            0 => (0, 0),
            step @ 1.. => (-start.div_euclid(step), -(start - limit).div_euclid(step)),
            step => {
                let back = |from: i32| from.div_euclid(-step) + 1;
                (back(start - limit), back(start))
            }
        };
        let clamp = |index: i32| (index.max(0) as usize).clamp(range.start, range.end);
        clamp(first)..clamp(end).max(clamp(first))
    }

    /// The pixel before sample `index`, clamped to the frame, and the weight of the next pixel. The last pixel counts
    /// as the next one of the last but one, so that there always is a next one.
    #[inline(always)]
    fn clamped(&self, index: usize) -> (usize, u32) {
        let at = self.at(index).clamp(0, self.last << FRACTION_BITS);
        if at >> FRACTION_BITS == self.last {
            return (self.last as usize - 1, WEIGHT_SUM);
        }
        ((at >> FRACTION_BITS) as usize, next_weight(at))
    }
}

/// Replaces `out` by the values of `plane` at the samples (`x`, `y`).
#[inline(always)]
pub(crate) fn sample_row(plane: &Plane, x: &Axis, y: &Axis, out: &mut [u8]) {
    // Only samples beyond the edge have to be clamped, and those are few.
    let inside = y.inside(x.inside(0..out.len()));
    let (source, width) = (&plane.pixels[..], plane.width as usize);
    let mut done = inside.start;
    if inside.len() >= GROUP_SIZE {
        while done < inside.end {
            // The last group may overlap the one before.
            let first = done.min(inside.end - GROUP_SIZE);
            let samples = sample_group(source, width, &x.group(first), &y.group(first));
            out[first..][..GROUP_SIZE].copy_from_slice(&samples);
            done = first + GROUP_SIZE;
        }
    }
    for i in (0..inside.start).chain(done..out.len()) {
        let ((column, right), (row, down)) = (x.clamped(i), y.clamped(i));
        let upper = row * width + column;
        let [left, next] = [upper, upper + 1].map(|at| {
            let [above, below] = [source[at], source[at + width]].map(u32::from);
            above * (WEIGHT_SUM - down) + below * down
        });
        out[i] = rounded(left * (WEIGHT_SUM - right) + next * right);
    }
}

/// The gray values at these coordinates, each before the last pixel.
#[inline(always)]
fn sample_group(
    source: &[u8],
    width: usize,
    x: &[i32; GROUP_SIZE],
    y: &[i32; GROUP_SIZE],
) -> [u8; GROUP_SIZE] {
    let uppers: [u32; GROUP_SIZE] = std::array::from_fn(|i| {
        ((y[i] >> FRACTION_BITS) * width as i32 + (x[i] >> FRACTION_BITS)) as u32
    });
    // Two neighbouring pixels are one 16-bit word.
    let (mut above, mut below) = ([0_u16; GROUP_SIZE], [0_u16; GROUP_SIZE]);
    for ((upper, above), below) in uppers.iter().zip(&mut above).zip(&mut below) {
        let square = &source[*upper as usize..][..width + 2];
        *above = u16::from_le_bytes([square[0], square[1]]);
        *below = u16::from_le_bytes([square[width], square[width + 1]]);
    }
    std::array::from_fn(|i| {
        let right = next_weight(x[i]);
        let line = |pair: u16| {
            let (left, next) = (u32::from(pair & 0xff), u32::from(pair >> 8));
            left * (WEIGHT_SUM - right) + next * right
        };
        let down = next_weight(y[i]);
        rounded(line(above[i]) * (WEIGHT_SUM - down) + line(below[i]) * down)
    })
}

/// The gray value of a sum that is weighted along both axes.
#[inline(always)]
fn rounded(sum: u32) -> u8 {
    const TOTAL: u32 = WEIGHT_SUM * WEIGHT_SUM;
    ((sum + TOTAL / 2) / TOTAL) as u8
}

/// The weight of the pixel after the coordinate `at`.
#[inline(always)]
fn next_weight(at: i32) -> u32 {
    ((at as u32 & ((1 << FRACTION_BITS) - 1)) * WEIGHT_SUM) >> FRACTION_BITS
}
