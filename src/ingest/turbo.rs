//! JPEG with libjpeg-turbo: luma alone, reduced by its inverse DCT.
//!
//! What can go wrong: it turns missing data into gray blocks, with a warning only. So this is a fast path: on any
//! warning, and for every layout that zune-jpeg refuses, zune-jpeg decides.

use super::jpeg_markers::Markers;
use super::limits::{Limits, MAX_JPEG_SCANS};
use crate::tracker::working_size;
use turbojpeg::{Decompressor, Image, PixelFormat, ScalingFactor};

/// The reductions for which it has vector instructions; the last one is none.
const REDUCTIONS: [ScalingFactor; 4] = [
    ScalingFactor::ONE_EIGHTH,
    ScalingFactor::ONE_QUARTER,
    ScalingFactor::ONE_HALF,
    ScalingFactor::ONE,
];

/// Decodes to the smallest size that is not smaller than the working image. Returns its width and height; its luma is
/// at the start of `pixels`. None where zune-jpeg is to decide.
pub(super) fn decode(
    bytes: &[u8],
    markers: &Markers,
    limits: &Limits,
    pixels: &mut Vec<u8>,
) -> Option<(u32, u32)> {
    let memory = markers.memory(1) + bytes.len() as u64;
    if !markers.is_usual() || limits.check_memory(memory).is_err() {
        return None;
    }
    // A new one each time: it would lend the tables of one file to the next one that has none.
    let mut decompressor = new_decompressor()?;
    let (width, height) = (markers.width as usize, markers.height as usize);
    let reduction = reduction(markers.width, markers.height);
    let (reduced_width, reduced_height) = (reduction.scale(width), reduction.scale(height));
    decompressor.set_scaling_factor(reduction).ok()?;
    let whole = &bytes[..markers.after_end()];
    let header = decompressor.read_header(whole).ok()?;
    if (header.width, header.height) != (width, height) {
        return None;
    }
    let len = reduced_width * reduced_height;
    if pixels.len() < len {
        pixels.resize(len, 0);
    }
    let image = Image {
        pixels: &mut pixels[..len],
        width: reduced_width,
        pitch: reduced_width,
        height: reduced_height,
        format: PixelFormat::GRAY,
    };
    decompressor.decompress(whole, image).ok()?;
    Some((reduced_width as u32, reduced_height as u32))
}

fn new_decompressor() -> Option<Decompressor> {
    let mut decompressor = Decompressor::new().ok()?;
    decompressor.set_scan_limit(MAX_JPEG_SCANS as u32).ok()?;
    Some(decompressor)
}

/// The strongest reduction that leaves at least the working size and divides both sides. With another one the last
/// column would stand for fewer pixels than the others, and boxes would be off.
fn reduction(width: u32, height: u32) -> ScalingFactor {
    let (working_width, working_height) = working_size(width, height);
    let fits = |side: u32, working: u32, factor: &ScalingFactor| {
        let divisor = factor.denom() as u32;
        side.is_multiple_of(divisor) && side / divisor >= working
    };
    let strongest = REDUCTIONS
        .into_iter()
        .find(|factor| fits(width, working_width, factor) && fits(height, working_height, factor));
    strongest.expect("an image is not smaller than its working size")
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
