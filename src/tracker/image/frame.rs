//! The working image that the tracker sees.
//!
//! Uploads come in any size; the paper's pixel lengths hold for images of 320 x 240. So every frame is brought to
//! at most [`WORKING_SIDE`] on its longer side, and the tracker works there. A frame remembers the size it was
//! uploaded with, which is what boxes are given in.

use crate::tracker::image::area_average::area_average;

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
    /// Working pixels along a side of one of `pixels`: 1, 2 or 4.
    downsample: u32,
}

impl GrayFrame {
    /// Makes the working image of `width` x `height` luma values in row order: an area average where the
    /// longer side is over [`WORKING_SIDE`] (aspect kept, each side rounded to whole pixels and at least 1),
    /// the pixels themselves otherwise. No allocation beyond the working image and two of its rows.
    ///
    /// # Errors
    /// A side of 0, or a number of values that is not `width * height`.
    pub fn from_luma(width: u32, height: u32, luma: Vec<u8>) -> Result<Self, FrameError> {
        let size = (width, height);
        let working = checked_working_size(size, size, luma.len())?;
        if working == size {
            return Ok(Self::new(size, working, luma));
        }
        let mut pixels = Vec::new();
        area_average(&luma, size, working, &mut pixels);
        Ok(Self::new(size, working, pixels))
    }

    /// The working image of a frame of `source` = width, height, from a reduced image of it that a decoder gives:
    /// `luma` of `size` = width, height, not smaller than the working image. The memory of `scratch` is used again,
    /// whatever it holds.
    ///
    /// # Errors
    /// As [`Self::from_luma`]; also a reduced image that is smaller than the working image or larger than the frame.
    pub fn from_reduced(
        source: (u32, u32),
        size: (u32, u32),
        luma: &[u8],
        mut scratch: Vec<u8>,
    ) -> Result<Self, FrameError> {
        let working = checked_working_size(source, size, luma.len())?;
        scratch.clear();
        if working == size {
            scratch.extend_from_slice(luma);
        } else {
            area_average(luma, size, working, &mut scratch);
        }
        Ok(Self::new(source, working, scratch))
    }

    fn new(source: (u32, u32), working: (u32, u32), pixels: Vec<u8>) -> Self {
        Self {
            width: working.0,
            height: working.1,
            pixels,
            source_width: source.0,
            source_height: source.1,
            downsample: 1,
        }
    }

    /// A frame of the same size with other `pixels`, as many as it has.
    pub(crate) fn with_pixels(&self, pixels: Vec<u8>) -> Self {
        debug_assert_eq!(pixels.len(), self.pixels.len());
        Self { pixels, ..*self }
    }

    /// The same frame in `pixels` that are `factor` times as large; `size` = columns, rows of them.
    pub(crate) fn in_larger_pixels(&self, factor: u32, size: (u32, u32), pixels: Vec<u8>) -> Self {
        debug_assert_eq!(pixels.len(), (size.0 * size.1) as usize);
        let (width, height) = size;
        Self {
            width,
            height,
            pixels,
            downsample: factor,
            ..*self
        }
    }

    /// Working pixels along a side of one of the pixels: 1, 2 or 4.
    pub(crate) fn downsample(&self) -> f64 {
        f64::from(self.downsample)
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

    /// The luma values, moved out, so that their memory can be used again.
    pub fn into_pixels(self) -> Vec<u8> {
        self.pixels
    }

    /// Width and height of the uploaded frame.
    pub fn source_size(&self) -> (u32, u32) {
        (self.source_width, self.source_height)
    }
}

/// The working size of a frame of size `source`, checked against a reduced image of `size` with `values` pixels.
fn checked_working_size(
    source: (u32, u32),
    size: (u32, u32),
    values: usize,
) -> Result<(u32, u32), FrameError> {
    let error = FrameError::Size {
        width: source.0,
        height: source.1,
        pixels: values,
    };
    let expected = u64::from(size.0) * u64::from(size.1);
    if source.0 == 0 || source.1 == 0 || values as u64 != expected {
        return Err(error);
    }
    let working = working_size(source.0, source.1);
    let fits = |working, size, source| working <= size && size <= source;
    match fits(working.0, size.0, source.0) && fits(working.1, size.1, source.1) {
        true => Ok(working),
        false => Err(error),
    }
}

/// The size of the working image of an upload of `width` x `height`, both above 0.
pub fn working_size(width: u32, height: u32) -> (u32, u32) {
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
