//! Histograms of gradient directions, one of the two kinds of feature vector: sums over a window of a frame.
//!
//! The strength of the gradient in each of a cell's pixels goes to nine unsigned directions, softly binned; the gray
//! values are summed beside them. Cells of hundreds of overlapping candidates are sums over the same pixels, so
//! running sums of each channel over a window are made once a frame, and a cell is four look-ups
//! ([`cells`](crate::tracker::features::hog)). The sums are interpolated between pixels: cells of a small target are a few pixels wide,
//! and rounding them would move the target.
//!
//! The channels of a pixel lie side by side and fill a cache line: one or two vector instructions work on all of them,
//! and a look-up touches one line.

use pulp::{Arch, Simd, WithSimd};

use crate::tracker::features::gradient::GradientRow;
use crate::tracker::features::sample_coords::{SampleCoord, SampleCoords};
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::image::rect::Rect;

/// Directions, from 0 to 180 degrees.
pub(crate) const DIRECTIONS: usize = 9;
/// The channel of the gray values, after the directions.
pub(crate) const GRAY: usize = DIRECTIONS;
/// The channels of a pixel or a cell, with those after [`GRAY`], which are zero.
pub(crate) const LANES: usize = 16;

/// The channels of a pixel or a cell, in a cache line.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Lanes(pub [f32; LANES]);

/// The same in vector registers: as many of these as they take are used ([`registers`]).
pub(crate) type Registers<S> = [<S as Simd>::f32s; LANES];

/// How many registers the channels take.
#[inline(always)]
pub(crate) fn registers<S: Simd>() -> usize {
    LANES / S::F32_LANES
}

impl Lanes {
    /// Nothing in any channel.
    pub const ZERO: Self = Self([0.0; LANES]);

    /// The channels as registers.
    #[inline(always)]
    pub fn load<S: Simd>(&self) -> &[S::f32s] {
        S::as_simd_f32s(&self.0).0
    }

    /// The channels as registers, to be written.
    #[inline(always)]
    pub fn load_mut<S: Simd>(&mut self) -> &mut [S::f32s] {
        S::as_mut_simd_f32s(&mut self.0).0
    }
}

/// Cells of so many working pixels lose nothing when sums are interpolated over two pixels, and a large target takes a
/// quarter of the room.
const COARSE: f64 = 8.0;

/// The share of a direction `b` (in bins) that is each channel's is max(0, slope |b - center| + top): a hat around the
/// channel's own direction, and for the first one, which is that at 180 degrees as well, what is far from the middle.
const CENTERS: Lanes = {
    let mut centers = Lanes::ZERO;
    let mut lane = 1;
    while lane < DIRECTIONS {
        centers.0[lane] = lane as f32;
        lane += 1;
    }
    centers.0[0] = DIRECTIONS as f32 / 2.0;
    centers
};
const SLOPES: Lanes = {
    let mut slopes = Lanes::ZERO;
    let mut lane = 1;
    while lane < DIRECTIONS {
        slopes.0[lane] = -1.0;
        lane += 1;
    }
    slopes.0[0] = 1.0;
    slopes
};
const TOPS: Lanes = {
    let mut tops = Lanes::ZERO;
    let mut lane = 1;
    while lane < DIRECTIONS {
        tops.0[lane] = 1.0;
        lane += 1;
    }
    tops.0[0] = 1.0 - DIRECTIONS as f32 / 2.0;
    tops
};
/// The share of the gray value in each channel.
const GRAY_SHARES: Lanes = {
    let mut shares = Lanes::ZERO;
    shares.0[GRAY] = 1.0;
    shares
};

/// Running sums of the channels over a window of a frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct IntegralChannels {
    left: usize,
    top: usize,
    right: usize,
    bottom: usize,
    /// Pixels from one corner to the next.
    downsample: usize,
    columns: usize,
    rows: usize,
    /// `(rows + 1) * (columns + 1)`: the sum over all pixels of the window above and left of a corner. Room beyond.
    sums: Vec<Lanes>,
    row: GradientRow,
}

/// [`IntegralChannels::compute`], to be compiled for the instructions that this machine has.
struct Compute<'a> {
    sums: &'a mut IntegralChannels,
    frame: &'a GrayFrame,
}

impl WithSimd for Compute<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.sums.compute_all(simd, self.frame);
    }
}

impl IntegralChannels {
    /// Sums up the channels over the part of `frame` that `window` (working pixels) touches. Where a cell is at least
    /// [`COARSE`] pixels wide and high, there is a corner at every second pixel only.
    pub fn compute(&mut self, frame: &GrayFrame, window: &Rect, cell: (f64, f64)) {
        let (left, right) = span(window.x, window.width, frame.width() as usize);
        let (top, bottom) = span(window.y, window.height, frame.height() as usize);
        (self.left, self.top) = (left, top);
        (self.right, self.bottom) = (right, bottom);
        self.downsample = if cell.0.min(cell.1) >= COARSE { 2 } else { 1 };
        self.columns = (right - left).div_ceil(self.downsample);
        self.rows = (bottom - top).div_ceil(self.downsample);
        Arch::new().dispatch(Compute { sums: self, frame });
    }

    #[inline(always)]
    fn compute_all<S: Simd>(&mut self, simd: S, frame: &GrayFrame) {
        let stride = self.columns + 1;
        let corners = stride * (self.rows + 1);
        if self.sums.len() < corners {
            self.sums.resize(corners, Lanes::ZERO);
        }
        self.sums[..stride].fill(Lanes::ZERO);
        for row in 0..self.rows {
            let (above, below) = self.sums.split_at_mut((row + 1) * stride);
            let (above, below) = (&above[row * stride..], &mut below[..stride]);
            below[0] = Lanes::ZERO;
            for step in 0..self.downsample {
                let y = self.top + row * self.downsample + step;
                if y >= self.bottom {
                    break;
                }
                let gradients = &mut self.row;
                let pixels = self.left..self.right;
                gradients.compute(frame, pixels, y, self.columns * self.downsample);
                match (self.downsample, step) {
                    (1, _) => sum_row::<S, 1, true>(simd, gradients, above, below),
                    (_, 0) => sum_row::<S, 2, true>(simd, gradients, above, below),
                    _ => sum_row::<S, 2, false>(simd, gradients, above, below),
                }
            }
        }
    }

    /// Makes `places` those of evenly spaced `x`, in working pixels, among the columns of corners.
    #[inline(always)]
    pub fn columns(&self, (x, step): (f32, f32), places: &mut SampleCoords) {
        let share = 1.0 / self.downsample as f32;
        places.take((x - self.left as f32) * share, step * share, self.columns);
    }

    /// Makes `places` those of evenly spaced `y`, in working pixels, among the rows of corners.
    #[inline(always)]
    pub fn rows(&self, (y, step): (f32, f32), places: &mut SampleCoords) {
        let share = 1.0 / self.downsample as f32;
        places.take((y - self.top as f32) * share, step * share, self.rows);
    }

    /// The sums along a line.
    #[inline(always)]
    pub fn row(&self, place: SampleCoord) -> SumsRow<'_> {
        let stride = self.columns + 1;
        let rows = &self.sums[place.corner * stride..][..2 * stride];
        let (upper, lower) = rows.split_at(stride);
        SumsRow {
            upper,
            lower,
            down: place.beyond,
        }
    }
}

/// The sums at the corners below a row of pixels, one for every `FACTOR` pixels: those of the row's pixels up to there
/// are added to the sums above (`IS_FIRST`), or to what is below already.
#[inline(always)]
fn sum_row<S: Simd, const FACTOR: usize, const IS_FIRST: bool>(
    simd: S,
    row: &GradientRow,
    above: &[Lanes],
    below: &mut [Lanes],
) {
    let (centers, slopes, tops) = (CENTERS, SLOPES, TOPS);
    let (centers, slopes, tops) = (centers.load::<S>(), slopes.load::<S>(), tops.load::<S>());
    let gray_shares = GRAY_SHARES;
    let gray_shares = gray_shares.load::<S>();
    let zero = simd.splat_f32s(0.0);
    let mut total = [zero; LANES];
    let (bins, _) = row.bins.as_chunks::<FACTOR>();
    let (strengths, _) = row.strengths.as_chunks::<FACTOR>();
    let (grays, _) = row.gray[1..].as_chunks::<FACTOR>();
    let pixels = bins.iter().zip(strengths).zip(grays);
    let corners = above[1..].iter().zip(&mut below[1..]);
    for (((bins, strengths), grays), (above, below)) in pixels.zip(corners) {
        let (above, below) = (above.load::<S>(), below.load_mut::<S>());
        for register in 0..registers::<S>() {
            // Apart from the sum so far, of which each pixel waits for the last one.
            let mut sum = zero;
            for i in 0..FACTOR {
                let bin = simd.splat_f32s(bins[i]);
                let away = simd.abs_f32s(simd.sub_f32s(bin, centers[register]));
                let share = simd.mul_add_e_f32s(slopes[register], away, tops[register]);
                let (strength, gray) = (simd.splat_f32s(strengths[i]), simd.splat_f32s(grays[i]));
                sum = simd.mul_add_e_f32s(gray_shares[register], gray, sum);
                sum = simd.mul_add_e_f32s(simd.max_f32s(share, zero), strength, sum);
            }
            total[register] = simd.add_f32s(total[register], sum);
            let before = if IS_FIRST {
                above[register]
            } else {
                below[register]
            };
            below[register] = simd.add_f32s(before, total[register]);
        }
    }
}

/// The rows of corners above and below a line, and how far it is beyond the upper one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SumsRow<'a> {
    upper: &'a [Lanes],
    lower: &'a [Lanes],
    down: f32,
}

impl SumsRow<'_> {
    /// The sum at a point of the line, interpolated between the four corners around it.
    #[inline(always)]
    pub fn at<S: Simd>(&self, simd: S, column: SampleCoord) -> Registers<S> {
        let [upper_left, upper_right] = &self.upper[column.corner..].as_chunks::<2>().0[0];
        let [lower_left, lower_right] = &self.lower[column.corner..].as_chunks::<2>().0[0];
        let (right, down) = (simd.splat_f32s(column.beyond), simd.splat_f32s(self.down));
        let between = |from: S::f32s, to: S::f32s, share: S::f32s| {
            simd.mul_add_e_f32s(simd.sub_f32s(to, from), share, from)
        };
        let mut sum = [simd.splat_f32s(0.0); LANES];
        for (register, sum) in sum.iter_mut().enumerate().take(registers::<S>()) {
            let upper = between(
                upper_left.load::<S>()[register],
                upper_right.load::<S>()[register],
                right,
            );
            let lower = between(
                lower_left.load::<S>()[register],
                lower_right.load::<S>()[register],
                right,
            );
            *sum = between(upper, lower, down);
        }
        sum
    }
}

/// The pixels from `start` over `extent`, within `count` pixels: at least one.
fn span(start: f64, extent: f64, count: usize) -> (usize, usize) {
    let first = (start.floor().max(0.0) as usize).min(count - 1);
    let last = ((start + extent).ceil().max(0.0) as usize).clamp(first + 1, count);
    (first, last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_the_pixels_above_and_left() {
        let luma = (0..60 * 50).map(|i| ((i * i / 7 + i) % 251) as u8);
        let frame = GrayFrame::from_luma(60, 50, luma.collect()).expect("a frame of this size");
        let mut sums = IntegralChannels::default();
        for (left, top, cell) in [(0, 0, 4.0), (7, 12, 4.0), (0, 0, 9.0), (7, 12, 9.0)] {
            // An odd width and height.
            let window = Rect::new(left as f64, top as f64, 31.0, 25.0);
            sums.compute(&frame, &window, (cell, cell));
            for (across, down) in [(18, 20), (31, 25)] {
                let mut expected = [0.0; 16];
                for y in top..top + down {
                    let mut row = GradientRow::default();
                    row.compute(&frame, left..left + across, y, across);
                    for (x, (bin, strength)) in row.bins.iter().zip(&row.strengths).enumerate() {
                        // A direction of 180 degrees is one of 0.
                        let (lower, share) = (*bin as usize % DIRECTIONS, bin.fract());
                        expected[lower] += strength * (1.0 - share);
                        expected[(lower + 1) % DIRECTIONS] += strength * share;
                        expected[GRAY] += f32::from(frame.pixels()[y * 60 + left + x]);
                    }
                }
                let corner = |at: usize| {
                    if cell < COARSE {
                        at
                    } else {
                        at.next_multiple_of(2)
                    }
                };
                let (mut rows, mut columns) = (SampleCoords::default(), SampleCoords::default());
                rows.prepare(1);
                columns.prepare(1);
                sums.rows(((top + corner(down)) as f32, 0.0), &mut rows);
                sums.columns(((left + corner(across)) as f32, 0.0), &mut columns);
                let row = sums.row(rows.get(0));
                let found = row.at(pulp::Scalar, columns.get(0));
                for (found, expected) in found.iter().zip(&expected) {
                    assert!((found - expected).abs() < 1.0, "{found} {expected}");
                }
            }
        }
    }
}
