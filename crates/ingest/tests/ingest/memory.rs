//! What decoding one frame allocates, counted by the allocator: never more than `max_memory`.

use bagtrack_ingest::{Limits, decode_to};
use bagtrack_testing::picture_files::{BASELINE, JpegForm, jpeg, jpeg_of};
use bagtrack_tracker::FrameFormat;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgb, Rgba};
use jpeg_encoder::{ColorType, SamplingFactor};
use std::io::{Cursor, Write};

/// Room for the working image, which is no part of the promise.
const WORKING_IMAGE: u64 = 1 << 20;
/// Where the chunks of a PNG after `IHDR` begin.
const AFTER_HEADER: usize = 8 + 25;

fn encode(image: DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, format)
        .expect("a drawn picture is encoded");
    bytes.into_inner()
}

/// Adds a colour profile that unpacks to `mib` MiB.
fn with_profile(mut png: Vec<u8>, mib: usize) -> Vec<u8> {
    let mut data = ZlibEncoder::new(b"iCCPprofile\0\0".to_vec(), Compression::fast());
    for _ in 0..mib {
        data.write_all(&[0; 1 << 20]).expect("memory takes it");
    }
    let data = data.finish().expect("memory takes it");
    let length = (data.len() as u32 - 4).to_be_bytes();
    let checksum = crc32fast::hash(&data).to_be_bytes();
    let chunk = [&length, data.as_slice(), &checksum].concat();
    png.splice(AFTER_HEADER..AFTER_HEADER, chunk);
    png
}

/// A PNG with a palette, whose pixels all have the first colour; `interlaced` in seven passes.
fn with_palette(side: usize, interlaced: bool) -> Vec<u8> {
    let chunk = |name: &[u8; 4], data: &[u8]| {
        let named = [name.as_slice(), data].concat();
        let length = (data.len() as u32).to_be_bytes();
        let checksum = crc32fast::hash(&named).to_be_bytes();
        [&length, named.as_slice(), &checksum].concat()
    };
    // The first pixel of each pass, and the steps to the next ones.
    let passes: &[[usize; 4]] = match interlaced {
        false => &[[0, 0, 1, 1]],
        true => &[
            [0, 0, 8, 8],
            [4, 0, 8, 8],
            [0, 4, 4, 8],
            [2, 0, 4, 4],
            [0, 2, 2, 4],
            [1, 0, 2, 2],
            [0, 1, 1, 2],
        ],
    };
    let mut pixels = ZlibEncoder::new(Vec::new(), Compression::fast());
    for [x, y, across, down] in passes {
        let row = vec![0; 1 + (side - x).div_ceil(*across)];
        for _ in 0..(side - y).div_ceil(*down) {
            pixels.write_all(&row).expect("memory takes it");
        }
    }
    let pixels = pixels.finish().expect("memory takes it");
    let size = (side as u32).to_be_bytes();
    let form = [8, 3, 0, 0, u8::from(interlaced)];
    let header = [size.as_slice(), &size, &form].concat();
    let chunks = [
        chunk(b"IHDR", &header),
        chunk(b"PLTE", &[9, 99, 199]),
        chunk(b"IDAT", &pixels),
        chunk(b"IEND", &[]),
    ];
    [b"\x89PNG\r\n\x1A\n".as_slice(), &chunks.concat()].concat()
}

/// Writes numbers with so many bits, the lowest bit first.
#[derive(Default)]
pub struct Bits {
    pub bytes: Vec<u8>,
    count: usize,
}

impl Bits {
    pub fn write(&mut self, number: usize, bits: usize) {
        for place in 0..bits {
            if self.count.is_multiple_of(8) {
                self.bytes.push(0);
            }
            let bit = (number >> place & 1) as u8;
            *self.bytes.last_mut().expect("it was pushed") |= bit << (self.count % 8);
            self.count += 1;
        }
    }

    /// A code in which the first `symbols` all have codes of `length` bits, 8 or 11.
    fn write_flat_code(&mut self, symbols: usize, length: usize) {
        self.write(0, 1);
        // Code lengths are written in a code with one symbol, `length`; the last of those stored here.
        let place = if length == 8 { 11 } else { 14 };
        self.write(place + 1 - 4, 4);
        self.write(0, 3 * place);
        self.write(1, 3);
        self.write(1, 1);
        self.write(5, 3);
        self.write(symbols - 2, 12);
    }

    /// A code with the symbol 0 alone.
    pub fn write_single_code(&mut self) {
        self.write(0b0001, 4);
    }
}

/// A lossless WebP of 1024 x 1024 equal pixels with `groups` groups of codes, each with 2048 codes of 11 bits.
pub fn with_code_groups(groups: usize) -> Vec<u8> {
    let mut bits = Bits::default();
    bits.write(0x2f, 8);
    bits.write(1023, 14);
    bits.write(1023, 14);
    bits.write(0, 4);
    // No transforms; 2048 colours that were seen before; groups for blocks of 4 x 4 pixels.
    bits.write(0, 1);
    bits.write(1, 1);
    bits.write(11, 4);
    bits.write(1, 1);
    bits.write(0, 3);
    // The groups' numbers, in green and red.
    bits.write(0, 1);
    bits.write_flat_code(256, 8);
    bits.write_flat_code(256, 8);
    (0..3).for_each(|_| bits.write_single_code());
    for block in 0..256 * 256 {
        let group = block % groups;
        for byte in [group % 256, group / 256] {
            bits.write(usize::from((byte as u8).reverse_bits()), 8);
        }
    }
    for _ in 0..groups {
        bits.write_flat_code(2048, 11);
        (0..4).for_each(|_| bits.write_single_code());
    }
    // The pixels: the symbol 0 in each group.
    for _ in 0..1024 * 1024 {
        bits.write(0, 11);
    }
    webp(&[webp_chunk(b"VP8L", &bits.bytes)])
}

/// A WebP of these chunks.
pub fn webp(chunks: &[Vec<u8>]) -> Vec<u8> {
    let chunks = chunks.concat();
    let length = (4 + chunks.len() as u32).to_le_bytes();
    [b"RIFF".as_slice(), &length, b"WEBP", &chunks].concat()
}

/// A chunk of a WebP.
pub fn webp_chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let length = (data.len() as u32).to_le_bytes();
    let padding = &[0][..data.len() % 2];
    [kind.as_slice(), &length, data, padding].concat()
}

/// The chunk with which an extended WebP of 1024 x 1024 pixels begins.
pub fn canvas(is_animation: bool) -> Vec<u8> {
    let flags = if is_animation { 2 } else { 0 };
    webp_chunk(b"VP8X", &[flags, 0, 0, 0, 0xff, 3, 0, 0xff, 3, 0])
}

/// The first frame of an animation, with sides of `side` pixels.
pub fn animation_frame(side: u32, chunks: &[Vec<u8>]) -> Vec<u8> {
    let side = &(side - 1).to_le_bytes()[..3];
    let header = [&[0; 6], side, side, &[40, 0, 0, 0]].concat();
    webp_chunk(b"ANMF", &[header, chunks.concat()].concat())
}

/// A lossy image with sides of 16,383 pixels that has a header and no data.
fn endless_lossy() -> Vec<u8> {
    let header = [0x10, 0, 0, 0x9d, 1, 0x2a, 0xff, 0x3f, 0xff, 0x3f];
    webp_chunk(b"VP8 ", &[&header[..], &[0; 1000]].concat())
}

#[test]
#[expect(
    clippy::too_many_lines,
    reason = "a list of files, each with its bound"
)]
fn no_format_allocates_more_than_is_promised() {
    let limits = Limits {
        max_memory: 32 << 20,
        ..Limits::default()
    };
    let rgba16 = |side| {
        let pixels = ImageBuffer::from_pixel(side, side, Rgba([700u16, 9000, 30_000, 65_535]));
        encode(DynamicImage::ImageRgba16(pixels), ImageFormat::Png)
    };
    let gray = ImageBuffer::from_pixel(5000, 5000, Luma([9u8]));
    let rgb =
        |side| DynamicImage::ImageRgb8(ImageBuffer::from_pixel(side, side, Rgb([9, 99, 199])));
    let rgba =
        |side| DynamicImage::ImageRgba8(ImageBuffer::from_pixel(side, side, Rgba([9, 99, 199, 7])));
    let progressive = JpegForm {
        scans: Some(6),
        ..BASELINE
    };
    let cmyk = |side: u32, form| {
        let samples = vec![99; 4 * (side * side) as usize];
        // The decoders do not take other samplings.
        let form = JpegForm {
            sampling: SamplingFactor::R_4_4_4,
            ..form
        };
        jpeg_of(&samples, (side, side), ColorType::Cmyk, form, None)
    };
    let format = FrameFormat {
        size: (320, 320),
        has_color: true,
    };
    for (name, file, is_taken) in [
        (
            "PNG with a profile of 28 MiB",
            with_profile(rgba16(1700), 28),
            true,
        ),
        ("PNG of 16 bits", rgba16(1850), true),
        ("PNG of 16 bits, too large", rgba16(2000), false),
        (
            "gray PNG",
            encode(DynamicImage::ImageLuma8(gray), ImageFormat::Png),
            false,
        ),
        ("WebP", encode(rgb(1700), ImageFormat::WebP), true),
        (
            "WebP, too large",
            encode(rgb(2600), ImageFormat::WebP),
            false,
        ),
        (
            "WebP with alpha",
            encode(rgba(1700), ImageFormat::WebP),
            true,
        ),
        ("WebP with 100 groups of codes", with_code_groups(100), true),
        (
            "WebP with 2000 groups of codes",
            with_code_groups(2000),
            false,
        ),
        (
            "WebP with 2000 groups of codes after its end",
            [webp(&[canvas(false)]), with_code_groups(2000).split_off(12)].concat(),
            false,
        ),
        (
            "lossy WebP that is larger than its canvas",
            webp(&[canvas(false), endless_lossy()]),
            false,
        ),
        (
            "WebP of an animation whose frame is larger than it says",
            webp(&[
                canvas(true),
                webp_chunk(b"ANIM", &[0; 6]),
                animation_frame(16, &[endless_lossy()]),
            ]),
            false,
        ),
        ("JPEG", encode(rgb(2500), ImageFormat::Jpeg), true),
        (
            "JPEG that is turned",
            jpeg(&rgb(2500).to_rgb8(), BASELINE, Some(6)),
            true,
        ),
        (
            "progressive JPEG",
            jpeg(&rgb(1500).to_rgb8(), progressive, None),
            true,
        ),
        (
            "progressive JPEG that is turned",
            jpeg(&rgb(1500).to_rgb8(), progressive, Some(6)),
            true,
        ),
        (
            "progressive JPEG, too large",
            jpeg(&rgb(3000).to_rgb8(), progressive, None),
            false,
        ),
        ("JPEG of CMYK", cmyk(2000, BASELINE), true),
        ("progressive JPEG of CMYK", cmyk(1200, progressive), true),
        ("PNG with a palette", with_palette(2500, false), true),
        (
            "interlaced PNG with a palette",
            with_palette(2500, true),
            true,
        ),
        (
            "interlaced PNG with a palette, too large",
            with_palette(6000, true),
            false,
        ),
    ] {
        let mut taken = None;
        let used = allocation_counter::measure(|| {
            taken = Some(decode_to(&file, &limits, &|_| format).map(drop));
        });
        println!(
            "{name}: {} of {} bytes, {taken:?}",
            used.bytes_max, limits.max_memory
        );
        assert!(
            used.bytes_max <= limits.max_memory + WORKING_IMAGE,
            "{name}: {}",
            used.bytes_max
        );
        assert_eq!(taken.map(|taken| taken.is_ok()), Some(is_taken), "{name}");
    }
}
