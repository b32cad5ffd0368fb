//! The frame in which the target was last seen, as a small image.

use serde::{Deserialize, Serialize};

use crate::tracker::image::downsample::downsample;
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::image::rect::Rect;
use crate::tracker::motion::particles::{Particle, StateBounds};

/// Working pixels, along x and along y, that are one of the small image: noise is averaged away, and a small target
/// still has some.
pub(crate) const CELL: usize = 4;

/// A working image in pixels that are [`CELL`] times as large.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct SmallImage {
    /// Row by row.
    pub pixels: Vec<u8>,
    width: u32,
}

impl SmallImage {
    /// Becomes the small image of `frame`: without pixels where that is too small.
    pub fn load(&mut self, frame: &GrayFrame) {
        self.width = downsample(frame, CELL, &mut self.pixels) as u32;
    }

    /// The number of pixels in a row.
    pub fn width(&self) -> usize {
        self.width as usize
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
    /// None before the first frame.
    pub target: Option<Particle>,
}

impl LastSeen {
    /// Records that the target is at `target` in the frame of `image`.
    pub fn record(&mut self, target: Particle, image: &SmallImage) {
        self.image.pixels.clone_from(&image.pixels);
        self.image.width = image.width;
        self.target = Some(target);
    }

    /// Whether this may be what a tracker of working images of this size has last seen, if it keeps that.
    pub fn is_valid_for(&self, (width, height): (u32, u32), is_kept: bool) -> bool {
        let (columns, rows) = (width as usize / CELL, height as usize / CELL);
        let fits = self.image.width() == columns && self.image.pixels.len() == columns * rows;
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
