//! The integral image of the gradient histogram's channels, over a window of a frame.
//!
//! Each pixel's gradient strength goes to its direction's channels ([`binning`](crate::features::hog::binning)),
//! and its gray value to a channel beside them. Cells of hundreds of overlapping candidates are sums over the same
//! pixels. So the channels are summed once a frame, and the sum over a cell is four look-ups. Look-ups between corners
//! are interpolated: cells of a small target are a few pixels wide, and rounding them would shift the target.
//!
//! Sums are single-precision numbers, which hold every whole number up to 2^24 = 16.8 million. Gray values are summed
//! minus the window's mean, so sums pass that only in windows of more than 130,000 pixels, half of them black and half
//! white. The largest window is the first frame's: 1280 x 1280 pixels. There sums reach 104 million of gray, and 418
//! million of strengths in stripes of full contrast, where neighbouring numbers are 8 and 32 apart: a cell is off by
//! less than 2 % of its largest value, as the tests measure.

use std::ops::Range;

use pulp::{Arch, Simd};

use crate::features::hog::binning::sum_row;
use crate::features::hog::channels::{LANES, Lanes, Registers, registers};
use crate::features::hog::gradient::GradientRow;
use crate::features::hog::sample_coords::{SampleCoord, SampleCoords};
use crate::image::frame::Frame;
use crate::image::rect::Rect;

/// Cells of at least this many pixels a side have a corner at every second pixel. Such cells lose no accuracy by it,
/// and a large target takes a quarter of the memory.
const MIN_COARSE_CELL: f64 = 8.0;

/// The sums of the channels over all pixels of a window above and left of each *corner* of a grid.
#[derive(Debug, Clone, Default)]
pub(crate) struct IntegralChannels {
    /// The window along x and along y.
    pub x: Axis,
    pub y: Axis,
    /// `(y.corners + 1) * (x.corners + 1)` sums, row by row. The vector may be longer.
    sums: Vec<Lanes>,
    /// The mean gray value of the window, rounded down: subtracted from every gray value.
    pub mean_gray: f32,
    gradients: GradientRow,
}

/// A window along one axis, in pixels of the frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct Axis {
    pixels: Range<usize>,
    /// Pixels from one corner to the next: 1 or 2.
    spacing: usize,
    /// Corners after the first one.
    corners: usize,
}

impl IntegralChannels {
    /// Sums the channels over the part of `frame` that `window` touches, for cells of size `cell` = width, height. All
    /// lengths are in pixels of `frame`.
    pub fn compute(&mut self, frame: &Frame, window: &Rect, cell: (f64, f64)) {
        let spacing = if cell.0.min(cell.1) >= MIN_COARSE_CELL {
            2
        } else {
            1
        };
        self.x = Axis::covering(window.x, window.width, frame.width(), spacing);
        self.y = Axis::covering(window.y, window.height, frame.height(), spacing);
        sum_window(self, frame);
    }

    /// The two rows of corners around coordinate `y`.
    #[inline(always)]
    pub fn row(&self, y: SampleCoord) -> IntegralRow<'_> {
        let stride = self.x.corners + 1;
        let rows = &self.sums[y.corner * stride..][..2 * stride];
        let (upper, lower) = rows.split_at(stride);
        IntegralRow {
            upper,
            lower,
            down: y.fraction,
        }
    }
}

impl Axis {
    /// The pixels of `count` that an interval touches, at least one.
    fn covering(start: f64, len: f64, count: u32, spacing: usize) -> Self {
        let count = count as usize;
        let first = (start.floor().max(0.0) as usize).min(count - 1);
        let end = ((start + len).ceil().max(0.0) as usize).clamp(first + 1, count);
        let corners = (end - first).div_ceil(spacing);
        Self {
            pixels: first..end,
            spacing,
            corners,
        }
    }

    /// Sets `coords` to evenly spaced coordinates from `start` on, in pixels of the frame.
    #[inline(always)]
    pub fn locate(&self, start: f32, step: f32, coords: &mut SampleCoords) {
        let factor = 1.0 / self.spacing as f32;
        let start = (start - self.pixels.start as f32) * factor;
        coords.set(start, step * factor, self.corners);
    }

    /// Whether all of an interval is in the window.
    #[inline(always)]
    pub fn contains(&self, start: f64, len: f64) -> bool {
        start >= self.pixels.start as f64 && start + len <= self.pixels.end as f64
    }

    /// How many pixels of the window are before `coord`. The last corner may be beyond the last pixel.
    pub fn pixels_before(&self, coord: SampleCoord) -> f32 {
        let at_corner = |corner: usize| (corner * self.spacing).min(self.pixels.len()) as f32;
        let before = at_corner(coord.corner);
        before + (at_corner(coord.corner + 1) - before) * coord.fraction
    }
}

#[pulp::with_simd(sum_window = Arch::new())]
#[inline(always)]
fn sum_window_simd<S: Simd>(simd: S, integral: &mut IntegralChannels, frame: &Frame) {
    let (columns, rows, spacing) = (integral.x.corners, integral.y.corners, integral.x.spacing);
    let (window, lines) = (integral.x.pixels.clone(), integral.y.pixels.clone());
    let stride = columns + 1;
    let corners = stride * (rows + 1);
    if integral.sums.len() < corners {
        integral.sums.resize(corners, Lanes::ZERO);
    }
    integral.sums[..stride].fill(Lanes::ZERO);
    let mut gray_sum = 0;
    for y in lines.clone() {
        let line = frame.luma.row(y)[window.clone()].iter();
        gray_sum += line.map(|&gray| u32::from(gray)).sum::<u32>();
    }
    let pixels = window.len() * lines.len();
    integral.mean_gray = (gray_sum / pixels as u32) as f32;
    for row in 0..rows {
        let (above, below) = integral.sums.split_at_mut((row + 1) * stride);
        let (above, below) = (&above[row * stride..], &mut below[..stride]);
        below[0] = Lanes::ZERO;
        let first = lines.start + row * spacing;
        for y in first..lines.end.min(first + spacing) {
            let (gradients, padded) = (&mut integral.gradients, columns * spacing);
            if y % 2 == 0 || y == lines.start {
                gradients.take_chroma(frame, window.clone(), y, padded);
            }
            gradients.compute(frame, window.clone(), y, padded, integral.mean_gray);
            match (spacing, y - first) {
                (1, _) => sum_row::<S, 1, true>(simd, gradients, above, below),
                (_, 0) => sum_row::<S, 2, true>(simd, gradients, above, below),
                _ => sum_row::<S, 2, false>(simd, gradients, above, below),
            }
        }
    }
}

/// The rows of corners above and below a coordinate, and its distance from the upper one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct IntegralRow<'a> {
    upper: &'a [Lanes],
    lower: &'a [Lanes],
    down: f32,
}

impl IntegralRow<'_> {
    /// The sum at column `x`, interpolated between the four corners around it.
    #[inline(always)]
    pub fn at<S: Simd>(&self, simd: S, x: SampleCoord) -> Registers<S> {
        let [upper_left, upper_right] = &self.upper[x.corner..].as_chunks::<2>().0[0];
        let [lower_left, lower_right] = &self.lower[x.corner..].as_chunks::<2>().0[0];
        let (right, down) = (simd.splat_f32s(x.fraction), simd.splat_f32s(self.down));
        let between = |from: S::f32s, to: S::f32s, share: S::f32s| {
            simd.mul_add_e_f32s(simd.sub_f32s(to, from), share, from)
        };
        let mut sum = [simd.splat_f32s(0.0); LANES];
        for (register, sum) in sum.iter_mut().enumerate().take(registers::<S>()) {
            let along = |left: &Lanes, next: &Lanes| {
                between(
                    left.load::<S>()[register],
                    next.load::<S>()[register],
                    right,
                )
            };
            let upper = along(upper_left, upper_right);
            *sum = between(upper, along(lower_left, lower_right), down);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::hog::channels::{DIRECTIONS, GRAY};

    #[test]
    fn sums_are_those_of_the_pixels_above_and_left() {
        let luma = (0..60 * 50).map(|i| ((i * i / 7 + i) % 251) as u8);
        let frame = Frame::from_luma(60, 50, luma.collect()).expect("a frame of this size");
        let mut sums = IntegralChannels::default();
        for (left, top, cell) in [(0, 0, 4.0), (7, 12, 4.0), (0, 0, 9.0), (7, 12, 9.0)] {
            // An odd width and height.
            let window = Rect::new(left as f64, top as f64, 31.0, 25.0);
            sums.compute(&frame, &window, (cell, cell));
            for (across, down) in [(18, 20), (31, 25)] {
                let mut expected = [0.0; 16];
                for y in top..top + down {
                    let mut row = GradientRow::default();
                    row.compute(&frame, left..left + across, y, across, 0.0);
                    for (x, (bin, half)) in row.bins.iter().zip(&row.half_strengths).enumerate() {
                        // A direction of 180 degrees is one of 0.
                        let (lower, share) = (*bin as usize % DIRECTIONS, bin.fract());
                        expected[lower] += 2.0 * half * (1.0 - share);
                        expected[(lower + 1) % DIRECTIONS] += 2.0 * half * share;
                        let gray = frame.pixels()[y * 60 + left + x];
                        expected[GRAY] += f32::from(gray) - sums.mean_gray;
                    }
                }
                let corner = |at: usize| {
                    if cell < MIN_COARSE_CELL {
                        at
                    } else {
                        at.next_multiple_of(2)
                    }
                };
                let (mut rows, mut columns) = (SampleCoords::default(), SampleCoords::default());
                rows.resize(1);
                columns.resize(1);
                sums.y.locate((top + corner(down)) as f32, 0.0, &mut rows);
                sums.x
                    .locate((left + corner(across)) as f32, 0.0, &mut columns);
                let row = sums.row(rows.get(0));
                let found = row.at(pulp::Scalar, columns.get(0));
                for (found, expected) in found.iter().zip(&expected) {
                    assert!((found - expected).abs() < 1.0, "{found} {expected}");
                }
            }
        }
    }

    /// The cell of 6.5 x 6.5 pixels at (`x`, `y`) in a frame of `side` x `side` pixels, and the sum at its last corner.
    fn cell(
        side: usize,
        luma: impl Fn(usize, usize) -> u8,
        x: f32,
        y: f32,
    ) -> [Registers<pulp::Scalar>; 2] {
        let luma = (0..side * side).map(|i| luma(i % side, i / side));
        let frame = Frame::from_luma(side as u32, side as u32, luma.collect());
        let frame = frame.expect("a frame of this size");
        let mut sums = IntegralChannels::default();
        let window = Rect::new(0.0, 0.0, side as f64, side as f64);
        sums.compute(&frame, &window, (4.0, 4.0));
        let (mut rows, mut columns) = (SampleCoords::default(), SampleCoords::default());
        rows.resize(2);
        columns.resize(2);
        sums.y.locate(y, 6.5, &mut rows);
        sums.x.locate(x, 6.5, &mut columns);
        let corner = |x: usize, y: usize| sums.row(rows.get(y)).at(pulp::Scalar, columns.get(x));
        let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
        let cell = std::array::from_fn(|i| (d[i] - c[i]) - (b[i] - a[i]));
        [cell, d]
    }

    /// The strengths of one direction pass 2^24 here.
    #[test]
    fn cells_of_stripes_over_the_whole_frame_stay_within_two_percent() {
        let stripes = |x: usize, _| if x % 4 < 2 { 0 } else { 255 };
        for side in [320, 1280] {
            for share in [0.82, 0.85, 0.96] {
                let at = (side as f32 * share).floor() + 0.3;
                let [cell, corner] = cell(side, stripes, at, at);
                assert!(corner[0] > 2_f32.powi(24));
                let expected = 255.0 * 6.5 * 6.5;
                let off = (cell[0] - expected).abs();
                assert!(off < 0.02 * expected, "{side}: {} {expected}", cell[0]);
            }
        }
    }

    /// Gray sums pass 2^24 here: the upper half is black, the lower half white.
    #[test]
    fn the_gray_of_cells_of_a_large_frame_stays_within_two_percent() {
        let side = 1280;
        let halves = |_, y: usize| if y < side / 2 { 0 } else { 255 };
        for (y, gray) in [(600.3, 0.0), (1250.7, 255.0)] {
            let [cell, corner] = cell(side, halves, 1260.2, y);
            assert!(y > 1000.0 || corner[GRAY].abs() > 2_f32.powi(24));
            let expected = (gray - 127.0) * 6.5 * 6.5;
            let off = (cell[GRAY] - expected).abs();
            assert!(off < 0.02 * 128.0 * 6.5 * 6.5, "{} {expected}", cell[GRAY]);
        }
    }
}
