//! JPEG with libjpeg-turbo: the stored channels, reduced by their inverse DCT.
//!
//! What can go wrong: libjpeg-turbo turns missing data into gray blocks, with a warning only. So this is a fast path:
//! on any warning, and for every layout that zune-jpeg refuses, zune-jpeg decides.

use super::jpeg_markers::Markers;
use super::limits::{Limits, MAX_JPEG_SCANS};
use super::stored_image::{Channel, StoredImage};
use bagtrack_tracker::FrameFormat;
use image::metadata::Orientation;
use std::borrow::Cow;
use turbojpeg::{Colorspace, Decompressor, Image, PixelFormat, ScalingFactor, Subsamp, YuvImage};

/// The reductions for which libjpeg-turbo has vector instructions, the strongest first.
const REDUCTIONS: [u32; 3] = [8, 4, 2];

/// The sizes of the planes that were decoded, one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct DecodedPlanes {
    pub(super) luma: (u32, u32),
    /// Where Cb begins; Cr follows.
    chroma_at: usize,
    /// The size of Cb and of Cr.
    chroma: Option<(u32, u32)>,
}

impl DecodedPlanes {
    /// The planes at the start of `pixels`.
    pub(super) fn of<'a>(
        &self,
        pixels: &'a [u8],
        source: (u32, u32),
        orientation: Orientation,
    ) -> StoredImage<'a> {
        let channel = |at: usize, size| Channel {
            values: Cow::Borrowed(&pixels[at..at + area(size)]),
            size,
        };
        let chroma = |size| {
            let cr_at = self.chroma_at + area(size);
            [channel(self.chroma_at, size), channel(cr_at, size)]
        };
        StoredImage {
            luma: channel(0, self.luma),
            chroma: self.chroma.map(chroma),
            source,
            orientation,
        }
    }
}

fn area((width, height): (u32, u32)) -> usize {
    width as usize * height as usize
}

/// Decodes to the smallest size that is not smaller than that of `format`, to the start of `pixels`. `None` where
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
    // A new decompressor for each file: a used one would lend the tables of its file to the next file without tables.
    let mut decompressor = new_decompressor()?;
    let size = (markers.width, markers.height);
    let reduction = match markers.reduction(format.size, &REDUCTIONS) {
        8 => ScalingFactor::ONE_EIGHTH,
        4 => ScalingFactor::ONE_QUARTER,
        2 => ScalingFactor::ONE_HALF,
        _ => ScalingFactor::ONE,
    };
    let scaled = |side: u32| reduction.scale(side as usize);
    let (width, height) = (scaled(size.0), scaled(size.1));
    decompressor.set_scaling_factor(reduction).ok()?;
    let whole = &bytes[..markers.after_end()];
    let header = decompressor.read_header(whole).ok()?;
    if (header.width as u32, header.height as u32) != size {
        return None;
    }
    let luma = (width as u32, height as u32);
    let is_color = format.has_color && header.subsamp != Subsamp::Gray;
    let subsampling = is_color.then_some(match (header.subsamp, header.colorspace) {
        (Subsamp::None, Colorspace::YCbCr) => (1, 1),
        (Subsamp::Sub2x1, Colorspace::YCbCr) => (2, 1),
        (Subsamp::Sub1x2, Colorspace::YCbCr) => (1, 2),
        (Subsamp::Sub2x2, Colorspace::YCbCr) => (2, 2),
        // Other layouts are rare.
        _ => return None,
    });
    let chroma = subsampling.map(|(x, y)| (luma.0.div_ceil(x), luma.1.div_ceil(y)));
    // With chroma, the sides of the luma are padded to a whole number of chroma pixels.
    let padded = subsampling.map_or(luma, |(x, y)| {
        (luma.0.next_multiple_of(x), luma.1.next_multiple_of(y))
    });
    let len = area(padded) + 2 * chroma.map_or(0, area);
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
        if padded.0 > luma.0 {
            for row in 1..height {
                let from = row * padded.0 as usize;
                pixels.copy_within(from..from + width, row * width);
            }
        }
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
    Some(DecodedPlanes {
        luma,
        chroma_at: area(padded),
        chroma,
    })
}

fn new_decompressor() -> Option<Decompressor> {
    let mut decompressor = Decompressor::new().ok()?;
    decompressor.set_scan_limit(MAX_JPEG_SCANS as u32).ok()?;
    Some(decompressor)
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
        let format = FrameFormat {
            size: working_size((markers.width, markers.height)),
            has_color: true,
        };
        let planes = decode(bytes, &markers, &Limits::default(), format, pixels)?;
        Some(planes.luma)
    }

    /// 320 pixels on the longer side.
    fn working_size(source: (u32, u32)) -> (u32, u32) {
        let longer = f64::from(source.0.max(source.1)).max(320.0);
        let shrink = |side: u32| ((f64::from(side) * 320.0 / longer).round() as u32).max(1);
        (shrink(source.0), shrink(source.1))
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
