//! The frame in which the target was last seen, as a small image.

use std::ops::Range;

use serde::{Deserialize, Serialize, Serializer};

use crate::image::downsample::{downsample_part, squares};
use crate::image::frame::Frame;
use crate::image::rect::Rect;
use crate::linalg::scratch::clear_and_reserve;
use crate::motion::particles::{Particle, StateBounds};

/// The side of a pixel of the small image, in working pixels: large enough to average noise away, small enough for a
/// small target to have some pixels.
pub(crate) const CELL: usize = 4;

/// What is further from the last box than this, in working pixels, is left out.
const MARGIN: f64 = 128.0;
/// The most pixels along a side of the small image.
const MAX_SIDE: usize = 256;
/// The bits of a pixel that count: the others are noise, which no snapshot can compress.
const KEPT_BITS: u8 = !3;

/// The part of a working image around the last box, in pixels that are [`CELL`] times as large.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct SmallImage {
    /// The gray values, row by row.
    #[serde(serialize_with = "as_bytes")]
    pub pixels: Vec<u8>,
    width: u32,
    /// The first column and row, in pixels of the small image.
    left: u32,
    top: u32,
}

/// Writes the pixels as one byte string; serde would write a vector element by element.
fn as_bytes<S: Serializer>(pixels: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bytes(pixels)
}

impl SmallImage {
    /// Becomes the small image of `frame` around the box of `particle`: without pixels where the frame is too small.
    pub fn load(&mut self, frame: &Frame, particle: &Particle, bounds: &StateBounds) {
        let (width, height) = squares(&frame.luma, CELL);
        let area = small_box(particle, bounds);
        let (x, y) = area.center();
        let span = |center: f64, length: f64, count: usize| {
            let reach = (length / 2.0 + MARGIN / CELL as f64).min(MAX_SIDE as f64 / 2.0);
            let start = ((center - reach).floor().max(0.0) as usize).min(count);
            start
                ..((center + reach).ceil().max(0.0) as usize)
                    .clamp(start, count)
                    .min(start + MAX_SIDE)
        };
        let (columns, rows) = (span(x, area.width, width), span(y, area.height, height));
        (self.left, self.top) = (columns.start as u32, rows.start as u32);
        self.width = columns.len() as u32;
        clear_and_reserve(&mut self.pixels, width.min(MAX_SIDE) * height.min(MAX_SIDE));
        downsample_part(&frame.luma, CELL, (columns, rows), &mut self.pixels);
        self.pixels.iter_mut().for_each(|pixel| *pixel &= KEPT_BITS);
    }

    /// The number of pixels in a row.
    pub fn width(&self) -> usize {
        self.width as usize
    }

    /// Its columns and rows in the small image of the whole frame.
    pub fn part(&self) -> (Range<usize>, Range<usize>) {
        let (left, top) = (self.left as usize, self.top as usize);
        let rows = self.pixels.len() / self.width().max(1);
        (left..left + self.width(), top..top + rows)
    }

    /// `count` pixels from `column` on in row `row` of the small image of the whole frame.
    #[inline(always)]
    pub fn row(&self, row: usize, column: usize, count: usize) -> &[u8] {
        let first = (row - self.top as usize) * self.width() + column - self.left as usize;
        &self.pixels[first..][..count]
    }
}

/// The box of `particle` in pixels of the small image.
pub(crate) fn small_box(particle: &Particle, bounds: &StateBounds) -> Rect {
    bounds.area(particle).in_pixels_of(CELL as f64)
}

/// The frame in which the target was last seen, and where the target was.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct LastSeen {
    pub image: SmallImage,
    /// The target in that frame; none before the first frame.
    pub target: Option<Particle>,
}

impl LastSeen {
    /// Records that the target is at `target` in the frame of `image`.
    pub fn record(&mut self, target: Particle, image: &SmallImage) {
        let mut pixels = std::mem::take(&mut self.image.pixels);
        pixels.clone_from(&image.pixels);
        self.image = SmallImage { pixels, ..*image };
        self.target = Some(target);
    }

    /// Whether this may be what a tracker of working images of this size has last seen; `is_kept` tells whether it
    /// keeps that.
    pub fn is_valid_for(&self, (width, height): (u32, u32), is_kept: bool) -> bool {
        let (columns, rows) = (width as usize / CELL, height as usize / CELL);
        let (of_columns, of_rows) = self.image.part();
        let fits = self.image.pixels.len() == of_columns.len() * of_rows.len()
            && of_columns.len().max(of_rows.len()) <= MAX_SIDE
            && of_columns.end <= columns
            && of_rows.end <= rows;
        let is_bounded = |target: &Particle| {
            let values = [target.x, target.y, target.scale];
            values.iter().all(|value| value.abs() <= 1e6)
        };
        match &self.target {
            Some(target) => is_kept && fits && is_bounded(target),
            None => !is_kept && *self == Self::default(),
        }
    }
}
