//! RGB to luma and chroma, by the weights of Rec. 601 in full range, as in JPEG.

use pulp::{Arch, Simd};

/// The chroma of gray.
pub const NEUTRAL: i32 = 128;

/// The size of chroma beside luma of this size.
pub fn chroma_size((width, height): (u32, u32)) -> (u32, u32) {
    (width.div_ceil(2), height.div_ceil(2))
}

/// Luma, Cb and Cr are these shares of R, G and B, in units of 1/65536. Those of luma sum to 65536, so white stays
/// white; those of chroma sum to 0, so gray has none.
const LUMA: [i32; 3] = [19_595, 38_470, 7_471];
const CHROMA: [[i32; 3]; 2] = [[-11_059, -21_709, 32_768], [32_768, -27_439, -5_329]];

/// The chroma of an image of `size`, Cb and Cr, in pixels twice as large: means of 2 x 2 pixels, or of fewer at the
/// edge. `rgb` gives each pixel of the image by its index, row by row.
pub fn chroma(size: (u32, u32), rgb: impl Fn(usize) -> [u8; 3]) -> [Vec<u8>; 2] {
    let (width, height) = (size.0 as usize, size.1 as usize);
    let (columns, rows) = chroma_size(size);
    let mut planes = [const { Vec::new() }; 2];
    for row in 0..rows as usize {
        let lines = [2 * row, (2 * row + 1).min(height - 1)];
        for column in 0..columns as usize {
            let mut sums = [0; 3];
            for line in lines {
                for x in [2 * column, (2 * column + 1).min(width - 1)] {
                    for (sum, value) in sums.iter_mut().zip(rgb(line * width + x)) {
                        *sum += i32::from(value);
                    }
                }
            }
            for (plane, weights) in planes.iter_mut().zip(CHROMA) {
                let sum: i32 = sums.iter().zip(weights).map(|(s, w)| s * w).sum();
                let value = ((sum + (1 << 17)) >> 18) + NEUTRAL;
                plane.push(value.clamp(0, 255) as u8);
            }
        }
    }
    planes
}

/// The order of the bytes of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Red first.
    Rgb,
    /// Blue first.
    Bgr,
}

/// Luma and chroma of an image of `size` in rows of whole pixels. A fourth value of a pixel is passed over.
pub fn planes<const N: usize>(
    pixels: &[[u8; N]],
    size: (u32, u32),
    order: Order,
) -> (Vec<u8>, [Vec<u8>; 2]) {
    let half = chroma_size(size);
    let half = half.0 as usize * half.1 as usize;
    let mut weights = [LUMA, CHROMA[0], CHROMA[1]];
    if order == Order::Bgr {
        weights.iter_mut().for_each(|of_plane| of_plane.reverse());
    }
    let mut luma = vec![0; pixels.len()];
    let mut chroma = [vec![0; half], vec![0; half]];
    fill_planes(pixels, size.0 as usize, weights, &mut luma, &mut chroma);
    (luma, chroma)
}

#[pulp::with_simd(fill_planes = Arch::new())]
#[inline(always)]
fn fill_planes_simd<S: Simd, const N: usize>(
    _: S,
    pixels: &[[u8; N]],
    width: usize,
    [of_luma, of_cb, of_cr]: [[i32; 3]; 3],
    luma: &mut [u8],
    [cb, cr]: &mut [Vec<u8>; 2],
) {
    let weigh = |values: [i32; 3], weights: [i32; 3]| {
        values[0] * weights[0] + values[1] * weights[1] + values[2] * weights[2]
    };
    for (luma, pixel) in luma.iter_mut().zip(pixels) {
        let values = [pixel[0], pixel[1], pixel[2]].map(i32::from);
        *luma = ((weigh(values, of_luma) + (1 << 15)) >> 16) as u8;
    }
    let of_square = |[a, b, c, d]: [[u8; N]; 4]| {
        let sum = |channel: usize| {
            let values = [a[channel], b[channel], c[channel], d[channel]].map(i32::from);
            values[0] + values[1] + values[2] + values[3]
        };
        let sums = [sum(0), sum(1), sum(2)];
        let value = |weights| ((weigh(sums, weights) + (1 << 17)) >> 18) + NEUTRAL;
        [of_cb, of_cr].map(|weights| value(weights).clamp(0, 255) as u8)
    };
    let columns = width.div_ceil(2);
    let planes = cb.chunks_exact_mut(columns);
    let planes = planes.zip(cr.chunks_exact_mut(columns));
    for (rows, (cb, cr)) in pixels.chunks(2 * width).zip(planes) {
        let (upper, lower) = rows.split_at(width);
        // The last row of an odd height counts twice, and so does the last column of an odd width.
        let lower = if lower.is_empty() { upper } else { lower };
        let pairs = upper.as_chunks::<2>().0.iter();
        let pairs = pairs.zip(lower.as_chunks::<2>().0);
        for ((&[a, b], &[c, d]), (cb, cr)) in pairs.zip(cb.iter_mut().zip(cr.iter_mut())) {
            [*cb, *cr] = of_square([a, b, c, d]);
        }
        if width % 2 == 1 {
            let (upper, lower) = (upper[width - 1], lower[width - 1]);
            [cb[columns - 1], cr[columns - 1]] = of_square([upper, upper, lower, lower]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_planes_are_those_of_single_pixels() {
        for size in [(1, 1), (5, 3), (6, 4), (67, 2), (64, 5)] {
            let len = size.0 as usize * size.1 as usize;
            let rgb: Vec<[u8; 3]> = (0..len)
                .map(|i| [0, 1, 2].map(|channel| ((i * 37 + channel * 101) * (i + 3) % 256) as u8))
                .collect();
            let luma = |rgb: &[u8; 3]| {
                let sum: i32 = (0..3).map(|i| i32::from(rgb[i]) * LUMA[i]).sum();
                ((sum + (1 << 15)) >> 16) as u8
            };
            let expected = (rgb.iter().map(luma).collect(), chroma(size, |i| rgb[i]));
            assert_eq!(planes(&rgb, size, Order::Rgb), expected);
            let bgr: Vec<[u8; 3]> = rgb.iter().map(|&[r, g, b]| [b, g, r]).collect();
            assert_eq!(planes(&bgr, size, Order::Bgr), expected);
            let rgbx: Vec<[u8; 4]> = rgb.iter().map(|&[r, g, b]| [r, g, b, r ^ b]).collect();
            assert_eq!(planes(&rgbx, size, Order::Rgb), expected);
        }
    }

    #[test]
    fn primaries_have_the_values_of_rec_601() {
        for (rgb, expected) in [
            ([255, 0, 0], [76, 85, 255]),
            ([0, 255, 0], [150, 44, 21]),
            ([0, 0, 255], [29, 255, 107]),
            ([200, 200, 200], [200, 128, 128]),
        ] {
            let (luma, [cb, cr]) = planes(&[rgb; 3], (3, 1), Order::Rgb);
            assert_eq!(luma, vec![expected[0]; 3]);
            assert_eq!((cb, cr), (vec![expected[1]; 2], vec![expected[2]; 2]));
        }
    }
}
