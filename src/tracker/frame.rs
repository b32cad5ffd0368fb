//! The working image that the tracker sees, and boxes.

use serde::{Deserialize, Serialize};

/// Longest side, in pixels, of the working image. The paper's pixel lengths hold at this size.
pub const WORKING_SIDE: u32 = 320;

/// A box: top-left corner and size in pixels. May reach over the edge of the frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rect {
    /// Left edge.
    pub x: f64,
    /// Top edge.
    pub y: f64,
    /// Width, above 0.
    pub width: f64,
    /// Height, above 0.
    pub height: f64,
}

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
    /// longer side is over [`WORKING_SIDE`], the pixels themselves otherwise.
    ///
    /// # Errors
    /// A side of 0, or a number of values that is not `width * height`.
    pub fn from_luma(width: u32, height: u32, luma: Vec<u8>) -> Result<Self, FrameError> {
        if width == 0 || height == 0 || luma.len() != width as usize * height as usize {
            return Err(FrameError::Size {
                width,
                height,
                pixels: luma.len(),
            });
        }
        Ok(Self {
            width,
            height,
            pixels: luma,
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
