//! The working image that the tracker sees.
//!
//! Uploads come in any size; the paper's pixel lengths hold for images of 320 x 240. So every frame is brought to
//! at most [`WORKING_SIDE`] on its longer side, and the tracker works there. A frame remembers the size it was
//! uploaded with, which is what boxes are given in.

use super::downscale;

pub use super::rect::Rect;

/// Longest side, in pixels, of the working image. The paper's pixel lengths hold at this size.
pub const WORKING_SIDE: u32 = 320;

/// Why pixels do not make a frame.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// A side is 0, or the number of pixels is not width x height.
    #[error("{pixels} pixels do not make a frame of {width} x {height}")]
    Size {
        /// Width given.
        width: u32,
        /// Height given.
        height: u32,
        /// Pixels given.
        pixels: usize,
    },
}

/// An 8-bit luma image, at most [`WORKING_SIDE`] on its longer side, that knows the size of the
/// uploaded frame it was made from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GrayFrame {
    width: u32,
    height: u32,
    pixels: Vec<u8>,
    source_width: u32,
    source_height: u32,
}

impl GrayFrame {
    /// Makes the working image of `width` x `height` luma values in row order: an area average where the
    /// longer side is over [`WORKING_SIDE`] (aspect kept, each side rounded to whole pixels and at least 1),
    /// the pixels themselves otherwise. No allocation beyond the working image and two of its rows.
    ///
    /// # Errors
    /// A side of 0, or a number of values that is not `width * height`.
    pub fn from_luma(width: u32, height: u32, luma: Vec<u8>) -> Result<Self, FrameError> {
        let expected = u64::from(width) * u64::from(height);
        if width == 0 || height == 0 || luma.len() as u64 != expected {
            return Err(FrameError::Size {
                width,
                height,
                pixels: luma.len(),
            });
        }
        let (working_width, working_height) = working_size(width, height);
        let pixels = if (working_width, working_height) == (width, height) {
            luma
        } else {
            downscale::area_average(&luma, (width, height), (working_width, working_height))
        };
        Ok(Self {
            width: working_width,
            height: working_height,
            pixels,
            source_width: width,
            source_height: height,
        })
    }

    /// Width of the working image.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height of the working image.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The luma values, row by row.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }

    /// Width and height of the uploaded frame.
    pub fn source_size(&self) -> (u32, u32) {
        (self.source_width, self.source_height)
    }
}

/// The size of the working image of an upload of `width` x `height`, both above 0.
pub(super) fn working_size(width: u32, height: u32) -> (u32, u32) {
    let longer = width.max(height);
    if longer <= WORKING_SIDE {
        return (width, height);
    }
    let shrink = |side: u32| {
        let scaled =
            (u64::from(side) * u64::from(WORKING_SIDE) + u64::from(longer) / 2) / u64::from(longer);
        u32::try_from(scaled)
            .expect("a scaled side is at most the working side")
            .max(1)
    };
    (shrink(width), shrink(height))
}
