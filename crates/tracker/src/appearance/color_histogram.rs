//! Colour histograms of the target and of what is around it.
//!
//! A target that bends or turns keeps its colours. By Bayes' rule, with equal priors, a pixel of colour c is the
//! target's with the probability p(c | target) / (p(c | target) + p(c | surroundings)), where both are histograms.
//! Without colour they are histograms of luma, which tell less.
//!
//! Half of the target's histogram stays that of the first frame, so that it does not drift to what covers the target.

use serde::{Deserialize, Serialize};

use crate::appearance::sparse_bins;
use crate::image::frame::Frame;
use crate::image::plane::Plane;
use crate::image::ycbcr::NEUTRAL;
use crate::linalg::vector_ops;
use crate::motion::particles::{Particle, StateBounds};

/// Bins of luma, and of each of Cb and Cr.
const LUMA_BINS: usize = 16;
const CHROMA_BINS: usize = 16;
/// Chroma outside of 64 to 191 is rare, and counts to the outermost bins.
const CHROMA_START: u8 = 64;

/// The sides of the target's area, as a multiple of the box: at its rim a box shows surroundings.
const INNER: f64 = 0.8;
/// The ring that is the surroundings, as multiples of the box.
const RING: (f64, f64) = (1.05, 2.0);
/// The share of the newest frame in the target's histogram and in that of the surroundings.
const RATE: f32 = 0.04;
const SURROUNDINGS_RATE: f32 = 0.08;
/// The share of the first frame's histogram that stays.
const FIRST_SHARE: f32 = 0.5;
/// A bin with less is emptied: its colour was not seen for some hundred frames.
const MIN_BIN: f32 = 1e-6;
/// The prior mass of a colour, and the target's share of it: a colour never seen is rather not the target's.
const PRIOR_MASS: f32 = 2e-4;
const PRIOR_TARGET: f32 = 0.3;

/// The histograms: empty before the first frame, else each with the sum 1 or, of no pixels, 0.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct ColorHistogram {
    #[serde(with = "sparse_bins")]
    first: Vec<f32>,
    #[serde(with = "sparse_bins")]
    target: Vec<f32>,
    #[serde(with = "sparse_bins")]
    surroundings: Vec<f32>,
}

/// Buffers for learning.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// How many pixels are in each bin.
    counts: Vec<f32>,
    /// The bins of a row of pixels.
    bins: Vec<u16>,
}

/// A part of an image, in pixels of chroma, each a square of 2 x 2 pixels of luma: the columns from `left` to before
/// `right`, the rows from `top` to before `bottom`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Part {
    pub left: usize,
    pub top: usize,
    pub right: usize,
    pub bottom: usize,
}

/// The pixels of a frame that histograms count: squares of 2 x 2 pixels of luma.
#[derive(Clone, Copy)]
pub(crate) struct ColorPixels<'a> {
    luma: &'a Plane,
    chroma: Option<&'a [Plane; 2]>,
    has_color: bool,
}

impl<'a> ColorPixels<'a> {
    /// The pixels of `frame`; `has_color` tells whether the session sees colour.
    pub fn of(frame: &'a Frame, has_color: bool) -> Self {
        Self {
            luma: &frame.luma,
            chroma: frame.chroma.as_ref(),
            has_color,
        }
    }

    /// The side of a pixel, in working pixels.
    pub fn side(&self) -> f64 {
        2.0 * f64::from(self.luma.pixel_side)
    }

    /// How many pixels there are in a row.
    pub fn columns(&self) -> usize {
        self.luma.width.div_ceil(2) as usize
    }

    /// How many pixels there are in a column.
    pub fn rows(&self) -> usize {
        self.luma.height.div_ceil(2) as usize
    }

    /// The part that is `factor` times the box of `particle`, and `margin` working pixels more on each side, clipped to
    /// the frame.
    pub fn part(
        &self,
        particle: &Particle,
        bounds: &StateBounds,
        factor: f64,
        margin: f64,
    ) -> Part {
        let area = bounds.area(particle);
        let (x, y) = area.center();
        let edge = |center: f64, length: f64, sign: f64, count: u32| {
            let at = center + sign * (factor * length / 2.0 + margin);
            (at / self.side())
                .round()
                .clamp(0.0, f64::from(count.div_ceil(2))) as usize
        };
        Part {
            left: edge(x, area.width, -1.0, self.luma.width),
            top: edge(y, area.height, -1.0, self.luma.height),
            right: edge(x, area.width, 1.0, self.luma.width),
            bottom: edge(y, area.height, 1.0, self.luma.height),
        }
    }

    /// Writes the bins of the pixels of row `y` of `part` to `out`.
    #[inline(always)]
    pub fn bins(&self, part: &Part, y: usize, out: &mut Vec<u16>) {
        let rows = [2 * y, 2 * y + 1].map(|y| self.luma.row(y));
        let width = rows[0].len();
        out.clear();
        out.reserve(self.columns());
        // The last column of an odd width has one column of luma.
        let end = part.right.min(width / 2);
        let whole = part.left.min(end)..end;
        let [upper, lower] = rows.map(|row| &row.as_chunks().0[whole.clone()]);
        out.extend(
            upper
                .iter()
                .zip(lower)
                .map(|(&upper, &lower)| luma_bin(upper, lower)),
        );
        if end.max(part.left) < part.right {
            let [upper, lower] = rows.map(|row| [row[width - 1]; 2]);
            out.push(luma_bin(upper, lower));
        }
        if !self.has_color {
            return;
        }
        for channel in 0..2 {
            let row = self.chroma.map(|planes| planes[channel].row(y));
            let row = row.unwrap_or(&[NEUTRAL as u8]);
            // Where pixels are larger than working pixels, the luma may have a column more than the chroma. That column
            // takes the chroma of the edge.
            let values = row
                .get(part.left..row.len().min(part.right))
                .unwrap_or_default();
            let (inside, beyond) = out.split_at_mut(values.len());
            for (bin, &value) in inside.iter_mut().zip(values) {
                *bin = *bin * CHROMA_BINS as u16 + chroma_bin(value);
            }
            let edge = chroma_bin(row[row.len() - 1]);
            for bin in beyond {
                *bin = *bin * CHROMA_BINS as u16 + edge;
            }
        }
    }
}

/// The bin of the mean of 2 x 2 values of luma.
#[inline(always)]
fn luma_bin(upper: [u8; 2], lower: [u8; 2]) -> u16 {
    let [upper, lower] = [upper, lower].map(|pair| {
        // The compiler vectorises the sum of a pair that is read as one number.
        let pair = u16::from_le_bytes(pair);
        (pair & 0xff) + (pair >> 8)
    });
    (upper + lower) / (4 * 256 / LUMA_BINS) as u16
}

#[inline(always)]
fn chroma_bin(value: u8) -> u16 {
    let bin = value.saturating_sub(CHROMA_START)
        / ((256 - 2 * CHROMA_START as usize) / CHROMA_BINS) as u8;
    u16::from(bin.min(CHROMA_BINS as u8 - 1))
}

impl ColorHistogram {
    /// How many bins there are.
    pub fn bin_count(has_color: bool) -> usize {
        match has_color {
            true => LUMA_BINS * CHROMA_BINS * CHROMA_BINS,
            false => LUMA_BINS,
        }
    }

    /// Whether it has seen the target.
    pub fn has_learned(&self) -> bool {
        !self.first.is_empty()
    }

    /// Forgets everything.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Learns from the box of `at` in `pixels`.
    pub fn learn(
        &mut self,
        pixels: ColorPixels<'_>,
        at: &Particle,
        bounds: &StateBounds,
        scratch: &mut Scratch,
    ) {
        let count = Self::bin_count(pixels.has_color);
        let target = [(INNER, 1.0)];
        let surroundings = [(RING.1, 1.0), (RING.0, -1.0)];
        let is_first = !self.has_learned();
        for (parts, bins, rate) in [
            (&target[..], &mut self.target, RATE),
            (&surroundings, &mut self.surroundings, SURROUNDINGS_RATE),
        ] {
            scratch.counts.clear();
            scratch.counts.resize(count, 0.0);
            for &(factor, sign) in parts {
                let part = pixels.part(at, bounds, factor, 0.0);
                add(pixels, &part, sign, scratch);
            }
            normalize(&mut scratch.counts);
            bins.resize(count, 0.0);
            let rate = if is_first { 1.0 } else { rate };
            for (bin, newest) in bins.iter_mut().zip(&scratch.counts) {
                let value = vector_ops::to_bfloat16(*bin + rate * (newest - *bin));
                *bin = if value > MIN_BIN { value } else { 0.0 };
            }
        }
        if is_first {
            self.first.clone_from(&self.target);
        }
    }

    /// Replaces `out` by the probability, for each bin, that a pixel of it is the target's, minus a half.
    pub fn posterior(&self, out: &mut Vec<f32>) {
        out.clear();
        let target = self.target.iter().zip(&self.first);
        out.extend(
            target
                .zip(&self.surroundings)
                .map(|((target, first), surroundings)| {
                    let target = target + FIRST_SHARE * (first - target);
                    let mass = target + surroundings + PRIOR_MASS;
                    (target + PRIOR_TARGET * PRIOR_MASS) / mass - 0.5
                }),
        );
    }

    /// Whether this may be the histogram of a tracker; `is_on` tells whether that tracker uses histograms.
    pub fn is_valid_for(&self, is_on: bool, has_color: bool) -> bool {
        let count = if is_on { Self::bin_count(has_color) } else { 0 };
        [&self.first, &self.target, &self.surroundings]
            .iter()
            .all(|bins| bins.len() == count && bins.iter().all(|bin| (0.0..=1.001).contains(bin)))
    }
}

fn add(pixels: ColorPixels<'_>, part: &Part, sign: f32, scratch: &mut Scratch) {
    for y in part.top..part.bottom {
        pixels.bins(part, y, &mut scratch.bins);
        for &bin in &scratch.bins {
            scratch.counts[usize::from(bin)] += sign;
        }
    }
}

fn normalize(bins: &mut [f32]) {
    let total: f32 = bins.iter().sum();
    if total > 0.0 {
        bins.iter_mut().for_each(|bin| *bin /= total);
    }
}
