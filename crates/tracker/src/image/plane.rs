//! One channel of an image: 8-bit values, row by row.

use crate::image::area_average::area_average;

/// A channel in pixels that may be larger than working pixels.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Plane {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<u8>,
    /// Working pixels along a side of one of `pixels`: 1, 2, 4 or 8.
    pub pixel_side: u32,
}

impl Plane {
    /// A plane of `size` = width, height.
    pub fn new(size: (u32, u32), pixels: Vec<u8>, pixel_side: u32) -> Self {
        debug_assert_eq!(pixels.len(), size.0 as usize * size.1 as usize);
        Self {
            width: size.0,
            height: size.1,
            pixels,
            pixel_side,
        }
    }

    /// Its width and height.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// The area average of this plane in `size`, of which neither side is longer.
    pub fn reduced(&self, size: (u32, u32)) -> Self {
        let mut pixels = Vec::new();
        area_average(&self.pixels, self.size(), size, &mut pixels);
        Self::new(size, pixels, self.pixel_side)
    }

    /// Row `y`; beyond the lower edge the last row.
    #[inline(always)]
    pub fn row(&self, y: usize) -> &[u8] {
        let width = self.width as usize;
        &self.pixels[y.min(self.height as usize - 1) * width..][..width]
    }
}
