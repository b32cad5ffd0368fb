//! JPEG with libjpeg-turbo: its own channels, reduced by their inverse DCT.
//!
//! What can go wrong: it turns missing data into gray blocks, with a warning only. So this is a fast path: on any
//! warning, and for every layout that zune-jpeg refuses, zune-jpeg decides.

use super::jpeg_markers::Markers;
use super::limits::{Limits, MAX_JPEG_SCANS};
use super::stored_image::{Channel, StoredImage};
use crate::tracker::FrameFormat;
use image::metadata::Orientation;
use std::borrow::Cow;
use turbojpeg::{Colorspace, Decompressor, Image, PixelFormat, ScalingFactor, Subsamp, YuvImage};

/// The reductions for which it has vector instructions; the last one is none.
const REDUCTIONS: [ScalingFactor; 4] = [
    ScalingFactor::ONE_EIGHTH,
    ScalingFactor::ONE_QUARTER,
    ScalingFactor::ONE_HALF,
    ScalingFactor::ONE,
];

/// The sizes of the planes that were decoded, one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct DecodedPlanes {
    pub(super) luma: (u32, u32),
    /// Of Cb and of Cr.
    pub(super) chroma: Option<(u32, u32)>,
}

impl DecodedPlanes {
    /// The planes at the start of `pixels`.
    pub(super) fn of<'a>(
        &self,
        pixels: &'a [u8],
        source: (u32, u32),
        orientation: Orientation,
    ) -> StoredImage<'a> {
        let mut rest = pixels;
        let mut next = |size: (u32, u32)| {
            let (values, after) = rest.split_at(area(size));
            rest = after;
            Channel {
                values: Cow::Borrowed(values),
                size,
            }
        };
        StoredImage {
            luma: next(self.luma),
            chroma: self.chroma.map(|size| [next(size), next(size)]),
            source,
            orientation,
        }
    }
}

fn area((width, height): (u32, u32)) -> usize {
    width as usize * height as usize
}

/// Decodes to the smallest size that is not smaller than that of `format`, to the start of `pixels`. None where
/// zune-jpeg is to decide.
pub(super) fn decode(
    bytes: &[u8],
    markers: &Markers,
    limits: &Limits,
    format: FrameFormat,
    pixels: &mut Vec<u8>,
) -> Option<DecodedPlanes> {
    let memory = markers.memory(3) + bytes.len() as u64;
    if !markers.is_usual() || limits.check_memory(memory).is_err() {
        return None;
    }
    // A new one each time: it would lend the tables of one file to the next one that has none.
    let mut decompressor = new_decompressor()?;
    let size = (markers.width, markers.height);
    let reduction = reduction(size, format.size);
    let scaled = |side: u32| reduction.scale(side as usize);
    let (width, height) = (scaled(size.0), scaled(size.1));
    decompressor.set_scaling_factor(reduction).ok()?;
    let whole = &bytes[..markers.after_end()];
    let header = decompressor.read_header(whole).ok()?;
    if (header.width as u32, header.height as u32) != size {
        return None;
    }
    let luma = (width as u32, height as u32);
    let subsampling = match header.subsamp {
        Subsamp::None => (1, 1),
        Subsamp::Sub2x1 => (2, 1),
        Subsamp::Sub1x2 => (1, 2),
        Subsamp::Sub2x2 => (2, 2),
        // Gray, or so rare that the luma alone is taken.
        _ => (0, 0),
    };
    let is_color = format.has_color && header.colorspace == Colorspace::YCbCr && subsampling.0 > 0;
    let chroma = is_color.then(|| {
        (
            luma.0.div_ceil(subsampling.0),
            luma.1.div_ceil(subsampling.1),
        )
    });
    let len = area(luma) + 2 * chroma.map_or(0, area);
    if pixels.len() < len {
        pixels.resize(len, 0);
    }
    if chroma.is_some() {
        let image = YuvImage {
            pixels: &mut pixels[..len],
            width,
            align: 1,
            height,
            subsamp: header.subsamp,
        };
        decompressor.decompress_to_yuv(whole, image).ok()?;
    } else {
        let image = Image {
            pixels: &mut pixels[..len],
            width,
            pitch: width,
            height,
            format: PixelFormat::GRAY,
        };
        decompressor.decompress(whole, image).ok()?;
    }
    Some(DecodedPlanes { luma, chroma })
}

fn new_decompressor() -> Option<Decompressor> {
    let mut decompressor = Decompressor::new().ok()?;
    decompressor.set_scan_limit(MAX_JPEG_SCANS as u32).ok()?;
    Some(decompressor)
}

/// The strongest reduction that leaves at least the working size and divides both sides. With another one the last
/// column would stand for fewer pixels than the others, and boxes would be off.
fn reduction((width, height): (u32, u32), working: (u32, u32)) -> ScalingFactor {
    let fits = |side: u32, working: u32, factor: &ScalingFactor| {
        let divisor = factor.denom() as u32;
        side.is_multiple_of(divisor) && side / divisor >= working
    };
    let strongest = REDUCTIONS
        .into_iter()
        .find(|factor| fits(width, working.0, factor) && fits(height, working.1, factor));
    strongest.unwrap_or(ScalingFactor::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use jpeg_encoder::{ColorType, Encoder};

    fn jpeg(width: u16, height: u16) -> Vec<u8> {
        let pixels = usize::from(width) * usize::from(height);
        let rgb: Vec<u8> = (0..3 * pixels).map(|i| (i * i / 97) as u8).collect();
        let mut bytes = Vec::new();
        let encoder = Encoder::new(&mut bytes, 80);
        let encoded = encoder.encode(&rgb, width, height, ColorType::Rgb);
        encoded.expect("an image of this size");
        bytes
    }

    fn reduced(bytes: &[u8], pixels: &mut Vec<u8>) -> Option<(u32, u32)> {
        let markers = Markers::read(bytes).expect("its end was not cut off");
        decode(bytes, &markers, &Limits::default(), pixels)
    }

    #[test]
    fn images_are_reduced_to_no_less_than_the_working_image() {
        for (size, expected) in [
            ((320, 240), (320, 240)),
            ((638, 480), (638, 480)),
            ((640, 480), (320, 240)),
            ((642, 479), (642, 479)),
            ((1280, 720), (320, 180)),
            ((1920, 1080), (480, 270)),
            ((1284, 724), (321, 181)),
            ((1282, 724), (641, 362)),
            ((2600, 8), (325, 1)),
        ] {
            let mut pixels = Vec::new();
            let got = reduced(&jpeg(size.0, size.1), &mut pixels);
            assert_eq!(got, Some(expected), "{size:?}");
            assert_eq!(pixels.len() as u32, expected.0 * expected.1);
        }
    }

    #[test]
    fn a_file_without_all_its_data_is_left_to_the_default_decoder() {
        let whole = jpeg(160, 128);
        let mut pixels = Vec::new();
        for kept in whole.len() / 4..whole.len() * 9 / 10 {
            let cut = [&whole[..kept], &[0xFF, 0xD9]].concat();
            assert_eq!(reduced(&cut, &mut pixels), None, "{kept} bytes kept");
        }
        assert_eq!(reduced(&whole, &mut pixels), Some((160, 128)));
    }

    /// Where the first segment of this marker begins, and where it ends.
    fn segment(bytes: &[u8], marker: u8) -> std::ops::Range<usize> {
        let pair = bytes.windows(2).position(|pair| pair == [0xFF, marker]);
        let at = pair.expect("the file has one");
        at..at + 2 + usize::from(u16::from_be_bytes([bytes[at + 2], bytes[at + 3]]))
    }

    #[test]
    fn a_file_neither_spoils_the_next_one_nor_lends_it_its_tables() {
        let whole = jpeg(160, 128);
        let mut pixels = Vec::new();
        let mut broken = whole.clone();
        let huffman = segment(&whole, 0xC4);
        broken[huffman.start + 5..huffman.end].fill(0xFE);
        let mut bare = whole.clone();
        bare.drain(segment(&whole, 0xDB));
        for other in [broken, bare] {
            assert_eq!(reduced(&whole, &mut pixels), Some((160, 128)));
            assert_eq!(reduced(&other, &mut pixels), None);
        }
        assert_eq!(reduced(&whole, &mut pixels), Some((160, 128)));
    }
}
