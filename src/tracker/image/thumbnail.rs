//! A small picture of a frame: the mean of each square of a few pixels.

use pulp::{Arch, Simd, WithSimd};

use crate::tracker::image::frame::GrayFrame;
use crate::tracker::linalg::scratch::clear_and_reserve;

/// Working pixels, along x and along y, that are one of the small picture: noise is averaged away, and a target of the
/// shortest side that is followed well still has some.
pub(crate) const CELL: usize = 4;

/// The even bytes of a word.
const EVEN: u32 = 0x00ff_00ff;

/// Every row of cells, to be compiled for the instructions that this machine has.
struct Means<'a> {
    /// Rows of pixels, and how long they are.
    pixels: &'a [u8],
    width: usize,
    out: &'a mut [u8],
}

impl WithSimd for Means<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let bands = self.pixels.chunks_exact(CELL * self.width);
        for (band, out) in bands.zip(self.out.chunks_exact_mut(self.width / CELL)) {
            let (upper, lower) = band.split_at(2 * self.width);
            let (a, b) = upper.split_at(self.width);
            let (c, d) = lower.split_at(self.width);
            let [a, b, c, d] = [a, b, c, d].map(|line| line.as_chunks::<CELL>().0);
            let lines = a.iter().zip(b).zip(c.iter().zip(d));
            for (out, ((&a, &b), (&c, &d))) in out.iter_mut().zip(lines) {
                // Four bytes in a word, and two sums in another: no sum of pairs needs more than its half.
                let pairs = |bytes: [u8; CELL]| {
                    let word = u32::from_le_bytes(bytes);
                    (word & EVEN) + (word >> 8 & EVEN)
                };
                let sums = pairs(a) + pairs(b) + pairs(c) + pairs(d);
                let sum = (sums + (sums >> 16)) & 0xffff;
                *out = ((sum + 8) / 16) as u8;
            }
        }
    }
}

/// Makes `out` the mean of each cell of `frame`, row by row; how many there are in a row.
pub(crate) fn shrink(frame: &GrayFrame, out: &mut Vec<u8>) -> usize {
    let width = frame.width() as usize;
    let (columns, rows) = (width / CELL, frame.height() as usize / CELL);
    clear_and_reserve(out, columns * rows);
    out.resize(columns * rows, 0);
    if columns > 0 {
        Arch::new().dispatch(Means {
            pixels: frame.pixels(),
            width,
            out,
        });
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_the_means_of_squares() {
        for (width, height) in [(320, 240), (37, 11), (4, 4), (3, 9), (9, 3)] {
            for luma in [
                vec![255; width * height],
                (0..width * height)
                    .map(|i| (i * i * 7 + i) as u8)
                    .collect::<Vec<_>>(),
            ] {
                let frame = GrayFrame::from_luma(width as u32, height as u32, luma.clone());
                let mut found = vec![1, 2, 3];
                let columns = shrink(&frame.expect("a frame of this size"), &mut found);
                assert_eq!(columns, width / 4);
                assert_eq!(found.len(), columns * (height / 4));
                for (index, found) in found.into_iter().enumerate() {
                    let (left, top) = (index % columns * 4, index / columns * 4);
                    let pixel = |i: usize| luma[(top + i / 4) * width + left + i % 4];
                    let sum: u32 = (0..16).map(|i| u32::from(pixel(i))).sum();
                    assert_eq!(u32::from(found), (sum + 8) / 16);
                }
            }
        }
    }
}
