//! The frames that the tracker sees: luma, and chroma where there is colour.
//!
//! A frame remembers the size that it was uploaded with; boxes are given in pixels of that size. A session sees all its
//! frames in one [`FrameFormat`]; a decoder that knows the format need not make larger frames.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::image::plane::Plane;
use crate::image::ycbcr::{self, Order, chroma_size};

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

/// How a session sees its frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameFormat {
    /// Width and height in working pixels.
    pub size: (u32, u32),
    /// Whether chroma counts.
    pub has_color: bool,
}

/// An 8-bit image, with the size of the uploaded frame that it was made from.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Frame {
    source: (u32, u32),
    pub(crate) luma: Plane,
    /// Cb and Cr of Rec. 601 in full range, in pixels twice as large as those of the luma.
    pub(crate) chroma: Option<[Plane; 2]>,
}

impl Frame {
    /// A gray frame of `width` x `height` luma values in row order.
    ///
    /// # Errors
    /// A side of 0, or a number of values that is not `width * height`.
    pub fn from_luma(width: u32, height: u32, luma: Vec<u8>) -> Result<Self, FrameError> {
        Self::from_reduced((width, height), (width, height), luma, None)
    }

    /// A frame of `width` x `height` RGB triples in row order, brought to luma and chroma by Rec. 601.
    ///
    /// # Errors
    /// As [`from_luma`](Self::from_luma).
    pub fn from_rgb(width: u32, height: u32, rgb: &[u8]) -> Result<Self, FrameError> {
        Self::from_pixels::<3>((width, height), rgb, Order::Rgb)
    }

    /// As [`from_rgb`](Self::from_rgb), of RGBX quadruples, the order of a browser's canvas. Their fourth value is
    /// passed over.
    ///
    /// # Errors
    /// As [`from_luma`](Self::from_luma).
    pub fn from_rgbx(width: u32, height: u32, rgbx: &[u8]) -> Result<Self, FrameError> {
        Self::from_pixels::<4>((width, height), rgbx, Order::Rgb)
    }

    /// As [`from_rgb`](Self::from_rgb), of BGR triples, the order of OpenCV.
    ///
    /// # Errors
    /// As [`from_luma`](Self::from_luma).
    pub fn from_bgr(width: u32, height: u32, bgr: &[u8]) -> Result<Self, FrameError> {
        Self::from_pixels::<3>((width, height), bgr, Order::Bgr)
    }

    fn from_pixels<const N: usize>(
        size: (u32, u32),
        values: &[u8],
        order: Order,
    ) -> Result<Self, FrameError> {
        let (pixels, rest) = values.as_chunks::<N>();
        let wanted = u64::from(size.0) * u64::from(size.1);
        if pixels.len() as u64 != wanted || pixels.is_empty() || !rest.is_empty() {
            return Err(FrameError::Size {
                width: size.0,
                height: size.1,
                pixels: pixels.len(),
            });
        }
        let (luma, chroma) = ycbcr::planes(pixels, size, order);
        Self::from_reduced(size, size, luma, Some(chroma))
    }

    /// A frame that was uploaded in the size `source` and reduced to `size`: `luma` of this size and chroma of half of
    /// it on each side, rounded up, each row by row.
    ///
    /// # Errors
    /// As [`from_luma`](Self::from_luma); also a size that is larger than `source`.
    pub fn from_reduced(
        source: (u32, u32),
        size: (u32, u32),
        luma: Vec<u8>,
        chroma: Option<[Vec<u8>; 2]>,
    ) -> Result<Self, FrameError> {
        let area = |size: (u32, u32)| u64::from(size.0) * u64::from(size.1);
        let half = chroma_size(size);
        let is_whole = luma.len() as u64 == area(size)
            && chroma
                .iter()
                .flatten()
                .all(|plane| plane.len() as u64 == area(half));
        if area(size) == 0 || size.0 > source.0 || size.1 > source.1 || !is_whole {
            return Err(FrameError::Size {
                width: source.0,
                height: source.1,
                pixels: luma.len(),
            });
        }
        Ok(Self {
            source,
            luma: Plane::new(size, luma, 1),
            chroma: chroma.map(|planes| planes.map(|plane| Plane::new(half, plane, 2))),
        })
    }

    /// The same frame with each plane changed by `change`, which gets the memory of that plane in `scratch`.
    pub(crate) fn map_planes(
        &self,
        scratch: Self,
        change: impl Fn(&Plane, Vec<u8>) -> Plane,
    ) -> Self {
        let [cb, cr] = scratch.chroma.unwrap_or_default();
        Self {
            source: self.source,
            luma: change(&self.luma, scratch.luma.pixels),
            chroma: self
                .chroma
                .as_ref()
                .map(|[of_cb, of_cr]| [change(of_cb, cb.pixels), change(of_cr, cr.pixels)]),
        }
    }

    /// The frame in `format`: an area average where it is larger, and without chroma where that does not count. None
    /// where it is smaller than the format.
    pub(crate) fn in_format(&self, format: FrameFormat) -> Option<Cow<'_, Self>> {
        let (width, height) = self.luma.size();
        if width < format.size.0 || height < format.size.1 {
            return None;
        }
        let chroma = self.chroma.as_ref().filter(|_| format.has_color);
        if self.luma.size() == format.size && chroma.is_some() == self.chroma.is_some() {
            return Some(Cow::Borrowed(self));
        }
        let half = chroma_size(format.size);
        Some(Cow::Owned(Self {
            source: self.source,
            luma: self.luma.reduced(format.size),
            chroma: chroma.map(|planes| [planes[0].reduced(half), planes[1].reduced(half)]),
        }))
    }

    /// Width of the luma.
    pub fn width(&self) -> u32 {
        self.luma.width
    }

    /// Height of the luma.
    pub fn height(&self) -> u32 {
        self.luma.height
    }

    /// The luma values, row by row.
    pub fn pixels(&self) -> &[u8] {
        &self.luma.pixels
    }

    /// Cb and Cr of Rec. 601 in full range, row by row, in pixels twice as large as those of the luma
    /// ([`ycbcr::chroma_size`]); none where the frame is gray.
    pub fn chroma(&self) -> Option<[&[u8]; 2]> {
        let [cb, cr] = self.chroma.as_ref()?;
        Some([&cb.pixels, &cr.pixels])
    }

    /// Whether it has chroma.
    pub fn has_color(&self) -> bool {
        self.chroma.is_some()
    }

    /// The memory of its planes, so that it can be used again: luma, Cb, Cr.
    pub fn into_planes(self) -> [Vec<u8>; 3] {
        let [cb, cr] = self.chroma.unwrap_or_default();
        [self.luma.pixels, cb.pixels, cr.pixels]
    }

    /// Width and height of the uploaded frame.
    pub fn source_size(&self) -> (u32, u32) {
        self.source
    }
}
