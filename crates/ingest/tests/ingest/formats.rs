//! Ingest of valid files: every format gives the same luma, the right way up.

use bagtrack_ingest::{Limits, decode};
use bagtrack_testing::picture_files::{
    BASELINE, JpegForm, color, encode, exif, gray, jpeg, jpeg_forms, jpeg_of,
};
use bagtrack_tracker::Frame;
use image::{DynamicImage, ImageFormat};
use jpeg_encoder::ColorType;

// Small enough that the working image is the picture itself; no side is a multiple of a block.
const SIZE: (u32, u32) = (101, 75);

fn frame(bytes: &[u8]) -> Frame {
    decode(bytes, &Limits::default()).expect("the file is valid")
}

/// Largest and mean absolute difference to the drawn picture's luma.
fn difference(frame: &Frame, expected: &image::GrayImage) -> (u8, f64) {
    assert_eq!((frame.width(), frame.height()), expected.dimensions());
    let differences: Vec<u8> = frame
        .pixels()
        .iter()
        .zip(expected.as_raw())
        .map(|(a, b)| a.abs_diff(*b))
        .collect();
    let mean = differences.iter().map(|&d| f64::from(d)).sum::<f64>() / differences.len() as f64;
    (differences.into_iter().max().unwrap_or(0), mean)
}

#[test]
fn png_and_lossless_webp_give_the_exact_luma_in_every_pixel_layout() {
    let rgb = DynamicImage::ImageRgb8(color(SIZE.0, SIZE.1));
    let expected = gray(SIZE.0, SIZE.1);
    let layouts = [
        ("rgb 8", rgb.clone()),
        ("rgba 8", rgb.to_rgba8().into()),
        ("gray 8", DynamicImage::ImageLuma8(expected.clone())),
        (
            "gray alpha 8",
            DynamicImage::ImageLuma8(expected.clone())
                .to_luma_alpha8()
                .into(),
        ),
        ("rgb 16", rgb.to_rgb16().into()),
        ("rgba 16", rgb.to_rgba16().into()),
        (
            "gray 16",
            DynamicImage::ImageLuma8(expected.clone())
                .to_luma16()
                .into(),
        ),
        (
            "gray alpha 16",
            DynamicImage::ImageLuma8(expected.clone())
                .to_luma_alpha16()
                .into(),
        ),
    ];
    for (name, image) in layouts {
        let (largest, _) = difference(&frame(&encode(&image, ImageFormat::Png)), &expected);
        assert!(largest <= 1, "PNG {name} is off by {largest}");
        if matches!(
            image,
            DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_)
        ) {
            let (largest, _) = difference(&frame(&encode(&image, ImageFormat::WebP)), &expected);
            assert!(largest <= 1, "WebP {name} is off by {largest}");
        }
    }
}

#[test]
fn every_form_of_jpeg_gives_the_luma_up_to_compression() {
    let picture = color(SIZE.0, SIZE.1);
    let expected = gray(SIZE.0, SIZE.1);
    let mut refused = 0;
    for (name, form) in jpeg_forms() {
        let bytes = jpeg(&picture, form, None);
        match decode(&bytes, &Limits::default()) {
            Ok(frame) => {
                let (_, mean) = difference(&frame, &expected);
                assert!(mean < 2.0, "{name}: off by {mean} on average");
            }
            // Channels one after the other and vertical subsampling: zune-jpeg 0.5.15 gives black for it.
            Err(error) => {
                assert!(form.scans.is_none(), "{name}: {error}");
                assert!(
                    error.to_string().contains("not supported"),
                    "{name}: {error}"
                );
                refused += 1;
            }
        }
    }
    assert!(refused < jpeg_forms().len() / 4);
    let samples = jpeg_of(expected.as_raw(), SIZE, ColorType::Luma, BASELINE, None);
    assert!(difference(&frame(&samples), &expected).1 < 2.0, "gray JPEG");
}

/// A picture of four flat quarters: red, green, blue, gray.
fn quarters() -> image::RgbImage {
    image::RgbImage::from_fn(104, 80, |x, y| match (x < 52, y < 40) {
        (true, true) => image::Rgb([220, 30, 30]),
        (false, true) => image::Rgb([30, 220, 30]),
        (true, false) => image::Rgb([30, 30, 220]),
        (false, false) => image::Rgb([90, 90, 90]),
    })
}

/// Checks Cb and Cr in the middle of each quarter, `order` saying which colour is where.
fn check_chroma(name: &str, bytes: &[u8], order: [usize; 4]) {
    // (B - Y) / 1.772 + 128 and (R - Y) / 1.402 + 128 of the four colours.
    let expected = [(96, 223), (65, 48), (223, 113), (128, 128)];
    let frame = frame(bytes);
    assert!(frame.has_color(), "{name}");
    let columns = frame.width().div_ceil(2) as usize;
    let rows = frame.height().div_ceil(2) as usize;
    let [_, cb, cr] = frame.into_planes();
    assert_eq!(
        (cb.len(), cr.len()),
        (columns * rows, columns * rows),
        "{name}"
    );
    for (quarter, color) in order.into_iter().enumerate() {
        let (x, y) = (
            columns / 4 + quarter % 2 * columns / 2,
            rows / 4 + quarter / 2 * rows / 2,
        );
        let found = (
            i32::from(cb[y * columns + x]),
            i32::from(cr[y * columns + x]),
        );
        let off = (found.0 - expected[color].0)
            .abs()
            .max((found.1 - expected[color].1).abs());
        assert!(
            off <= 3,
            "{name}, quarter {quarter}: {found:?}, not {:?}",
            expected[color]
        );
    }
}

#[test]
fn every_format_gives_the_chroma_of_its_pixels() {
    let image = DynamicImage::ImageRgb8(quarters());
    let as_stored = [0, 1, 2, 3];
    for (name, form) in jpeg_forms() {
        let bytes = jpeg(&quarters(), form, None);
        // Rare layouts are refused, or decoded in gray.
        let usual = ["R_4_4_4", "R_4_2_2", "R_4_4_0", "R_4_2_0"];
        let is_usual = usual.iter().any(|usual| name.contains(usual));
        if decode(&bytes, &Limits::default()).is_ok_and(|frame| frame.has_color() || is_usual) {
            check_chroma(&name, &bytes, as_stored);
        }
    }
    for (name, layout) in [
        ("rgb", image.clone()),
        ("rgba", image.to_rgba8().into()),
        ("rgb 16", image.to_rgb16().into()),
    ] {
        check_chroma(name, &encode(&layout, ImageFormat::Png), as_stored);
    }
    check_chroma("webp", &encode(&image, ImageFormat::WebP), as_stored);
    let turned = with_png_exif(&encode(&image, ImageFormat::Png), 3);
    check_chroma("upside down", &turned, [3, 2, 1, 0]);
    let gray = encode(&DynamicImage::ImageLuma8(gray(20, 20)), ImageFormat::Png);
    assert!(!frame(&gray).has_color());
}

#[test]
fn cmyk_jpegs_give_luma_too() {
    let picture = color(SIZE.0, SIZE.1);
    let cmyk: Vec<u8> = picture
        .pixels()
        .flat_map(|p| [255 - p.0[0], 255 - p.0[1], 255 - p.0[2], 0])
        .collect();
    for kind in [ColorType::Cmyk, ColorType::CmykAsYcck] {
        let mut decoded = 0;
        for (name, form) in jpeg_forms() {
            let bytes = jpeg_of(&cmyk, SIZE, kind, form, None);
            // A file may be refused, but not decoded wrongly.
            if let Ok(frame) = decode(&bytes, &Limits::default()) {
                let (_, mean) = difference(&frame, &gray(SIZE.0, SIZE.1));
                assert!(mean < 3.0, "{kind:?} {name}: off by {mean} on average");
                decoded += 1;
            }
        }
        assert!(decoded >= 9, "{kind:?}: only {decoded} forms were decoded");
    }
}

#[test]
fn transparency_is_blended_over_black() {
    let picture = image::RgbaImage::from_pixel(8, 8, image::Rgba([255, 255, 255, 51]));
    let bytes = encode(&DynamicImage::ImageRgba8(picture), ImageFormat::Png);
    assert!(frame(&bytes).pixels().iter().all(|&luma| luma == 51));
}

/// What a viewer shows for each EXIF orientation of a stored picture (EXIF 2.3, tag 274).
fn upright(stored: &DynamicImage, orientation: u8) -> DynamicImage {
    match orientation {
        1 => stored.clone(),
        2 => stored.fliph(),
        3 => stored.rotate180(),
        4 => stored.flipv(),
        5 => stored.rotate90().fliph(),
        6 => stored.rotate90(),
        7 => stored.rotate270().fliph(),
        _ => stored.rotate270(),
    }
}

#[test]
fn exif_orientation_turns_jpeg_png_and_webp_upright() {
    let picture = color(SIZE.0, SIZE.1);
    let stored = DynamicImage::ImageLuma8(gray(SIZE.0, SIZE.1));
    for orientation in 1..=8 {
        let expected = upright(&stored, orientation).into_luma8();
        let files = [
            ("JPEG", jpeg(&picture, BASELINE, Some(orientation))),
            (
                "PNG",
                with_png_exif(
                    &encode(&picture.clone().into(), ImageFormat::Png),
                    orientation,
                ),
            ),
            (
                "WebP",
                with_webp_exif(
                    &encode(&picture.clone().into(), ImageFormat::WebP),
                    orientation,
                ),
            ),
        ];
        for (name, bytes) in files {
            let frame = frame(&bytes);
            assert_eq!(frame.source_size(), expected.dimensions());
            let (_, mean) = difference(&frame, &expected);
            assert!(
                mean < 2.0,
                "{name}, orientation {orientation}: off by {mean}"
            );
        }
    }
}

#[test]
fn an_unknown_orientation_leaves_the_picture_as_stored() {
    let picture = color(SIZE.0, SIZE.1);
    let plain = frame(&jpeg(&picture, BASELINE, None));
    assert_eq!(frame(&jpeg(&picture, BASELINE, Some(0))), plain);
    assert_eq!(frame(&jpeg(&picture, BASELINE, Some(9))), plain);
}

#[test]
fn large_frames_know_their_size_before_downscaling() {
    let bytes = jpeg(&color(1000, 500), BASELINE, Some(6));
    let frame = frame(&bytes);
    assert_eq!(frame.source_size(), (500, 1000));
}

#[test]
fn a_large_jpeg_becomes_the_average_of_its_luma() {
    // No multiples of each other, of a block, or of the working image.
    for size in [(1283, 727), (640, 480), (331, 1040)] {
        let picture = color(size.0, size.1);
        let exact = frame(&encode(&picture.clone().into(), ImageFormat::Png));
        let expected =
            image::GrayImage::from_raw(exact.width(), exact.height(), exact.pixels().to_vec())
                .expect("a frame has all its pixels");
        for scans in [None, Some(5)] {
            let form = JpegForm { scans, ..BASELINE };
            let frame = frame(&jpeg(&picture, form, None));
            assert_eq!(frame.source_size(), size);
            let (_, mean) = difference(&frame, &expected);
            assert!(mean < 1.0, "{size:?}, scans {scans:?}: off by {mean}");
        }
    }
}

fn with_png_exif(png: &[u8], orientation: u8) -> Vec<u8> {
    const END_OF_HEADER: usize = 8 + 25;
    let mut chunk = b"eXIf".to_vec();
    chunk.extend(exif(orientation));
    let length = (chunk.len() - 4) as u32;
    let checksum = crc32(&chunk);
    [
        &png[..END_OF_HEADER],
        &length.to_be_bytes(),
        &chunk,
        &checksum.to_be_bytes(),
        &png[END_OF_HEADER..],
    ]
    .concat()
}

/// The checksum of PNG chunks (ISO 3309), bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            (crc >> 1) ^ (0xEDB8_8320 * (crc & 1))
        })
    })
}

/// The simple file's one chunk behind an extended header that announces EXIF, and the EXIF chunk.
fn with_webp_exif(webp: &[u8], orientation: u8) -> Vec<u8> {
    const HAS_EXIF: u8 = 8;
    let side = |pixels: u32| (pixels - 1).to_le_bytes()[..3].to_vec();
    let header = [vec![HAS_EXIF, 0, 0, 0], side(SIZE.0), side(SIZE.1)].concat();
    let block = exif(orientation);
    let body = [
        b"WEBP".as_slice(),
        b"VP8X",
        &10u32.to_le_bytes(),
        &header,
        &webp[12..],
        b"EXIF",
        &(block.len() as u32).to_le_bytes(),
        &block,
    ]
    .concat();
    [
        b"RIFF".as_slice(),
        &(body.len() as u32).to_le_bytes(),
        &body,
    ]
    .concat()
}
