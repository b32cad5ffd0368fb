//! What decoding one frame allocates, counted by the allocator: never more than `max_memory`.

use bagtrack::ingest::{Limits, decode_to};
use bagtrack::tracker::FrameFormat;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgb, Rgba};
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

/// Adds a colour profile that unpacks to so many MiB.
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

#[test]
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
        ("JPEG", encode(rgb(2500), ImageFormat::Jpeg), true),
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
