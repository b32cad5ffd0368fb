//! RGB to luma and chroma, by the weights of Rec. 601 in full range, as in JPEG.

/// The chroma of gray.
pub(crate) const NEUTRAL: i32 = 128;

/// The size of chroma beside luma of this size.
pub(crate) fn chroma_size((width, height): (u32, u32)) -> (u32, u32) {
    (width.div_ceil(2), height.div_ceil(2))
}

/// Luma, Cb and Cr are these shares of R, G and B, in units of 1/65536. Those of luma sum to 65536, so white stays
/// white; those of chroma sum to 0, so gray has none.
const LUMA: [i32; 3] = [19_595, 38_470, 7_471];
const CHROMA: [[i32; 3]; 2] = [[-11_059, -21_709, 32_768], [32_768, -27_439, -5_329]];

/// The luma of an RGB triple.
#[inline(always)]
pub(crate) fn luma(rgb: [u8; 3]) -> u8 {
    let sum: i32 = rgb.iter().zip(LUMA).map(|(&c, w)| i32::from(c) * w).sum();
    ((sum + (1 << 15)) >> 16) as u8
}

/// The chroma of an image of `size`, Cb and Cr, in pixels twice as large: means of 2 x 2 pixels, or of fewer at the edge.
/// `rgb` gives each pixel of the image by its index, row by row.
pub(crate) fn chroma(size: (u32, u32), rgb: impl Fn(usize) -> [u8; 3]) -> [Vec<u8>; 2] {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn primaries_have_the_values_of_rec_601() {
        for (rgb, expected) in [
            ([255, 0, 0], [76, 85, 255]),
            ([0, 255, 0], [150, 44, 21]),
            ([0, 0, 255], [29, 255, 107]),
            ([200, 200, 200], [200, 128, 128]),
        ] {
            let [cb, cr] = chroma((3, 1), |_| rgb);
            assert_eq!(luma(rgb), expected[0]);
            assert_eq!((cb, cr), (vec![expected[1]; 2], vec![expected[2]; 2]));
        }
    }
}
