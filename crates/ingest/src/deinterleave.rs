//! Y, Cb and Cr side by side, as zune-jpeg gives them, to planes.

use pulp::{Arch, Simd};

use bagtrack_tracker::ycbcr::chroma_size;

/// The luma of an image of `size` in rows of YCbCr triples, and its chroma in pixels twice as large: means of 2 x 2
/// pixels, or of fewer at the edge.
pub(super) fn planes(ycbcr: &[u8], size: (u32, u32)) -> (Vec<u8>, [Vec<u8>; 2]) {
    let half = chroma_size(size);
    let half = half.0 as usize * half.1 as usize;
    let mut luma = vec![0; ycbcr.len() / 3];
    let mut chroma = [vec![0; half], vec![0; half]];
    split(ycbcr, size.0 as usize, &mut luma, &mut chroma);
    (luma, chroma)
}

#[pulp::with_simd(split = Arch::new())]
#[inline(always)]
fn split_simd<S: Simd>(
    _: S,
    ycbcr: &[u8],
    width: usize,
    luma: &mut [u8],
    [cb, cr]: &mut [Vec<u8>; 2],
) {
    let pixels = ycbcr.as_chunks::<3>().0;
    for (luma, pixel) in luma.iter_mut().zip(pixels) {
        *luma = pixel[0];
    }
    let columns = width.div_ceil(2);
    let planes = cb
        .chunks_exact_mut(columns)
        .zip(cr.chunks_exact_mut(columns));
    for (rows, (cb, cr)) in pixels.chunks(2 * width).zip(planes) {
        let (upper, lower) = rows.split_at(width);
        // The last row of an odd height counts twice, and so does the last column of an odd width.
        let lower = if lower.is_empty() { upper } else { lower };
        let mean = |squares: [[u8; 3]; 4], channel: usize| {
            let sum: u16 = squares.iter().map(|pixel| u16::from(pixel[channel])).sum();
            ((sum + 2) / 4) as u8
        };
        let pairs = upper
            .as_chunks::<2>()
            .0
            .iter()
            .zip(lower.as_chunks::<2>().0);
        for (([a, b], [c, d]), (cb, cr)) in pairs.zip(cb.iter_mut().zip(cr.iter_mut())) {
            let square = [*a, *b, *c, *d];
            (*cb, *cr) = (mean(square, 1), mean(square, 2));
        }
        if width % 2 == 1 {
            let square = [
                upper[width - 1],
                upper[width - 1],
                lower[width - 1],
                lower[width - 1],
            ];
            (cb[columns - 1], cr[columns - 1]) = (mean(square, 1), mean(square, 2));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_are_those_of_the_pixels() {
        for (width, height) in [(1, 1), (5, 3), (6, 4), (33, 2)] {
            let value =
                |x: usize, y: usize, channel: usize| ((x * 7 + y * 31 + channel * 90) % 251) as u8;
            let ycbcr: Vec<u8> = (0..3 * width * height)
                .map(|i| value(i / 3 % width, i / 3 / width, i % 3))
                .collect();
            let (luma, chroma) = planes(&ycbcr, (width as u32, height as u32));
            for (i, &found) in luma.iter().enumerate() {
                assert_eq!(found, value(i % width, i / width, 0));
            }
            for (channel, plane) in chroma.iter().enumerate() {
                let columns = width.div_ceil(2);
                assert_eq!(plane.len(), columns * height.div_ceil(2));
                for (i, &found) in plane.iter().enumerate() {
                    let (x, y) = (i % columns * 2, i / columns * 2);
                    let at = |x: usize, y: usize| {
                        u16::from(value(x.min(width - 1), y.min(height - 1), channel + 1))
                    };
                    let sum = at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1);
                    assert_eq!(u16::from(found), (sum + 2) / 4);
                }
            }
        }
    }
}
