//! Colour to luma and chroma, by the weights of JPEG (Rec. 601).

use bagtrack_tracker::ycbcr;
use image::{DynamicImage, GrayImage};

/// 0.299, 0.587, 0.114 in units of 1/65536; they sum to exactly 65536, so white stays white.
const WEIGHTS: [u64; 3] = [19_595, 38_470, 7_471];

/// Luma of 8-bit RGB triples.
pub(super) fn luma_of_rgb8(rgb: &[u8]) -> Vec<u8> {
    rgb.as_chunks::<3>()
        .0
        .iter()
        .map(|&pixel| luma8(pixel))
        .collect()
}

/// Luma of a decoded image. Transparency is blended over black; 16 bits are rounded to 8.
pub(super) fn luma_of(image: DynamicImage) -> GrayImage {
    let (width, height) = (image.width(), image.height());
    let luma: Vec<u8> = match image {
        DynamicImage::ImageLuma8(gray) => return gray,
        DynamicImage::ImageLumaA8(gray) => {
            gray.pixels().map(|p| over_black(p.0[0], p.0[1])).collect()
        }
        DynamicImage::ImageRgb8(rgb) => luma_of_rgb8(&rgb),
        DynamicImage::ImageRgba8(rgba) => rgba
            .pixels()
            .map(|p| over_black(luma8([p.0[0], p.0[1], p.0[2]]), p.0[3]))
            .collect(),
        DynamicImage::ImageLuma16(gray) => gray.pixels().map(|p| to_8_bits(p.0[0])).collect(),
        DynamicImage::ImageRgb16(rgb) => rgb.pixels().map(|p| to_8_bits(luma16(p.0))).collect(),
        DynamicImage::ImageLumaA16(gray) => gray
            .pixels()
            .map(|p| to_8_bits(over_black16(p.0[0], p.0[1])))
            .collect(),
        // RGBA in 16 bits, and formats that later versions of `image` may give.
        other => other
            .into_rgba16()
            .pixels()
            .map(|p| {
                let [r, g, b, alpha] = p.0;
                to_8_bits(over_black16(luma16([r, g, b]), alpha))
            })
            .collect(),
    };
    GrayImage::from_raw(width, height, luma).expect("one luma value was made for each pixel")
}

/// The chroma of a decoded image in half of its columns and rows; `None` for a gray one.
pub(super) fn chroma_of(image: &DynamicImage) -> Option<[Vec<u8>; 2]> {
    let size = (image.width(), image.height());
    let blend = |[r, g, b, alpha]: [u8; 4]| [r, g, b].map(|value| over_black(value, alpha));
    Some(match image {
        image if !image.color().has_color() => return None,
        DynamicImage::ImageRgb8(rgb) => {
            let pixels = rgb.as_raw().as_chunks::<3>().0;
            ycbcr::chroma(size, |i| pixels[i])
        }
        DynamicImage::ImageRgba8(rgba) => {
            let pixels = rgba.as_raw().as_chunks::<4>().0;
            ycbcr::chroma(size, |i| blend(pixels[i]))
        }
        DynamicImage::ImageRgb16(rgb) => {
            let pixels = rgb.as_raw().as_chunks::<3>().0;
            ycbcr::chroma(size, |i| pixels[i].map(to_8_bits))
        }
        DynamicImage::ImageRgba16(rgba) => {
            let pixels = rgba.as_raw().as_chunks::<4>().0;
            ycbcr::chroma(size, |i| blend(pixels[i].map(to_8_bits)))
        }
        other => {
            // Formats that later versions of `image` may give.
            let rgba = other.to_rgba8();
            let pixels = rgba.as_raw().as_chunks::<4>().0;
            ycbcr::chroma(size, |i| blend(pixels[i]))
        }
    })
}

fn weigh(channels: [u64; 3]) -> u64 {
    let sum: u64 = channels.iter().zip(WEIGHTS).map(|(c, w)| c * w).sum();
    (sum + (1 << 15)) >> 16
}

fn luma8(rgb: [u8; 3]) -> u8 {
    weigh(rgb.map(u64::from)) as u8
}

fn luma16(rgb: [u16; 3]) -> u16 {
    weigh(rgb.map(u64::from)) as u16
}

fn over_black(luma: u8, alpha: u8) -> u8 {
    ((u32::from(luma) * u32::from(alpha) + 127) / 255) as u8
}

fn over_black16(luma: u16, alpha: u16) -> u16 {
    ((u64::from(luma) * u64::from(alpha) + 32_767) / 65_535) as u16
}

fn to_8_bits(value: u16) -> u8 {
    ((u32::from(value) + 128) / 257) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn primaries_have_the_weights_of_rec_601() {
        assert_eq!(luma8([255, 0, 0]), 76);
        assert_eq!(luma8([0, 255, 0]), 150);
        assert_eq!(luma8([0, 0, 255]), 29);
    }

    #[test]
    fn gray_keeps_its_value_at_either_depth() {
        for value in 0..=255u8 {
            assert_eq!(luma8([value; 3]), value);
            let wide = u16::from(value) * 257;
            assert_eq!(to_8_bits(luma16([wide; 3])), value);
        }
    }

    #[test]
    fn transparent_is_black_and_opaque_is_unchanged() {
        assert_eq!(over_black(200, 0), 0);
        assert_eq!(over_black(200, 255), 200);
        assert_eq!(over_black(200, 128), 100);
    }
}
