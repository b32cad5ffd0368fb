//! Ingest of damaged and hostile bytes: an error that says what is wrong, never a panic, never a large bill.

use crate::memory::{Bits, animation_frame, canvas, webp, webp_chunk};
use bagtrack_ingest::{IngestError, Limits, decode, inspect};
use bagtrack_testing::picture_files::{BASELINE, JpegForm, color, encode, jpeg};
use image::{DynamicImage, ImageFormat};
use proptest::prelude::*;
use std::sync::mpsc;
use std::time::Duration;

const SMALL: Limits = Limits {
    max_bytes: 1 << 20,
    max_side: 512,
    max_pixels: 512 * 512,
    max_memory: 16 << 20,
};

fn files() -> Vec<(&'static str, Vec<u8>)> {
    let picture = color(61, 47);
    let image: DynamicImage = picture.clone().into();
    let progressive = JpegForm {
        scans: Some(5),
        ..BASELINE
    };
    let restarts = JpegForm {
        restart: Some(2),
        ..BASELINE
    };
    vec![
        ("baseline JPEG", jpeg(&picture, BASELINE, Some(6))),
        ("progressive JPEG", jpeg(&picture, progressive, None)),
        ("JPEG with restarts", jpeg(&picture, restarts, None)),
        ("PNG", encode(&image, ImageFormat::Png)),
        (
            "16-bit PNG",
            encode(&image.to_rgba16().into(), ImageFormat::Png),
        ),
        ("WebP", encode(&image, ImageFormat::WebP)),
    ]
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    for (name, bytes) in files() {
        decode(&bytes, &SMALL).expect("the whole file is valid");
        for length in 0..bytes.len() {
            let result = decode(&bytes[..length], &SMALL);
            assert!(
                result.is_err(),
                "{name} of {} bytes, cut to {length}",
                bytes.len()
            );
        }
    }
}

#[test]
fn a_jpeg_cut_in_its_data_and_closed_with_an_end_marker_is_an_error() {
    // Some cameras and proxies close what they cut. zune-jpeg 0.5.15 by itself fills in gray blocks for the missing
    // data, in strict mode too.
    let picture = color(160, 480);
    for scans in [None, Some(5)] {
        let bytes = jpeg(&picture, JpegForm { scans, ..BASELINE }, None);
        decode(&bytes, &SMALL).expect("the whole file is valid");
        for kept in (20..=95).step_by(5) {
            let cut = [&bytes[..bytes.len() * kept / 100], &[0xFF, 0xD9]].concat();
            assert!(
                decode(&cut, &SMALL).is_err(),
                "scans {scans:?}, {kept} % kept"
            );
        }
    }
}

/// Where the first segment of this marker begins.
fn segment(bytes: &[u8], marker: u8) -> usize {
    let pair = bytes.windows(2).position(|pair| pair == [0xFF, marker]);
    pair.expect("the file has one")
}

#[test]
fn a_jpeg_with_bytes_between_its_headers_is_an_error() {
    // rusty_jpeg 0.4.8 by itself passes over them.
    let mut bytes = jpeg(&color(61, 47), BASELINE, None);
    let at = segment(&bytes, 0xC0);
    bytes.splice(at..at, [7; 9]);
    assert!(decode(&bytes, &SMALL).is_err());
}

#[test]
fn a_jpeg_with_a_huffman_code_of_ones_alone_is_an_error() {
    // With such a code, missing blocks could be read out of the one-bits that are put at the end. rusty_jpeg 0.4.8 by
    // itself takes it.
    let mut bytes = jpeg(&color(61, 47), BASELINE, None);
    let table = segment(&bytes, 0xC4) + 5;
    let values: usize = bytes[table..table + 16]
        .iter()
        .map(|&n| usize::from(n))
        .sum();
    let code = [&[2u8, 0][..], &[0; 14], &[0, 1]].concat();
    bytes.splice(table..table + 16 + values, code);
    let length = (3 + 16 + 2u16).to_be_bytes();
    bytes[table - 3..table - 1].copy_from_slice(&length);
    let error = decode(&bytes, &SMALL).expect_err("its table is full");
    assert!(error.to_string().contains("Huffman"), "{error}");
}

#[test]
fn bytes_after_the_end_are_ignored() {
    for (name, bytes) in files() {
        let longer = [bytes.as_slice(), b"trailing"].concat();
        assert_eq!(decode(&longer, &SMALL), decode(&bytes, &SMALL), "{name}");
    }
}

#[test]
fn other_types_and_no_bytes_are_an_unknown_format() {
    for bytes in [
        b"".as_slice(),
        b"GIF89a\0",
        b"BM\0",
        b"RIFF\0\0\0\0WAVE",
        &[0xFF, 0xD8],
    ] {
        assert_eq!(decode(bytes, &SMALL), Err(IngestError::UnknownFormat));
    }
    let text = decode(b"@frame.jpg", &SMALL);
    assert_eq!(text, Err(IngestError::UnreadFormat("text")));
}

#[test]
fn each_limit_is_named_with_both_numbers() {
    let bytes = jpeg(&color(300, 200), BASELINE, None);
    let too_large = |limits: Limits| match decode(&bytes, &limits) {
        Err(IngestError::TooLarge(text)) => text,
        other => panic!("expected a limit, got {other:?}"),
    };
    let text = too_large(Limits {
        max_bytes: 100,
        ..SMALL
    });
    assert!(
        text.contains("100") && text.contains(&bytes.len().to_string()),
        "{text}"
    );
    let text = too_large(Limits {
        max_side: 299,
        ..SMALL
    });
    assert!(text.contains("300") && text.contains("299"), "{text}");
    let text = too_large(Limits {
        max_pixels: 59_999,
        ..SMALL
    });
    assert!(text.contains("60000") && text.contains("59999"), "{text}");
    let text = too_large(Limits {
        max_memory: 1000,
        ..SMALL
    });
    assert!(text.contains("memory") && text.contains("1000"), "{text}");
    for format in [ImageFormat::Png, ImageFormat::WebP] {
        let bytes = encode(&color(300, 200).into(), format);
        for limits in [
            Limits {
                max_side: 299,
                ..SMALL
            },
            Limits {
                max_pixels: 59_999,
                ..SMALL
            },
            Limits {
                max_memory: 1000,
                ..SMALL
            },
        ] {
            let result = decode(&bytes, &limits);
            assert!(
                matches!(result, Err(IngestError::TooLarge(_))),
                "{format:?}: {result:?}"
            );
        }
    }
}

#[test]
fn a_few_hundred_bytes_that_claim_forty_million_pixels_are_refused_unread() {
    let mut bytes = jpeg(&color(16, 16), BASELINE, None);
    let header = bytes
        .windows(2)
        .position(|pair| pair == [0xFF, 0xC0])
        .expect("a baseline file has a frame header");
    bytes[header + 5..header + 7].copy_from_slice(&4882u16.to_be_bytes());
    bytes[header + 7..header + 9].copy_from_slice(&8192u16.to_be_bytes());
    let error = decode(&bytes, &Limits::default()).expect_err("it has almost no data");
    assert!(
        error.to_string().contains("less data than its size needs"),
        "{error}"
    );
}

#[test]
fn arithmetic_and_lossless_jpegs_are_a_typed_error() {
    let bytes = jpeg(&color(32, 32), BASELINE, None);
    for start_of_frame in [0xC3, 0xC5, 0xC9, 0xCA, 0xCB] {
        let mut other = bytes.clone();
        let header = other.windows(2).position(|pair| pair == [0xFF, 0xC0]);
        other[header.expect("a baseline file has a frame header") + 1] = start_of_frame;
        let result = decode(&other, &SMALL);
        assert!(
            matches!(result, Err(IngestError::Damaged { format: "JPEG", .. })),
            "{result:?}"
        );
    }
}

#[test]
fn a_picture_without_height_or_width_is_a_typed_error() {
    let image: DynamicImage = color(32, 32).into();
    let png = encode(&image, ImageFormat::Png);
    let jpeg = jpeg(&color(32, 32), BASELINE, None);
    let of_jpeg = segment(&jpeg, 0xC0) + 5;
    // Height and width of two bytes each behind the marker, the length and the precision; width and height of four.
    for (format, file, sides) in [
        (
            "JPEG",
            &jpeg,
            [of_jpeg..of_jpeg + 2, of_jpeg + 2..of_jpeg + 4],
        ),
        ("PNG", &png, [16..20, 20..24]),
    ] {
        for side in sides {
            let mut none = file.clone();
            none[side.clone()].fill(0);
            // A side of 0 that passes here would panic in the tracker's arithmetic.
            let result = inspect(&none, &SMALL).map(|file| file.size());
            assert!(
                matches!(result, Err(IngestError::Damaged { .. })),
                "{format} {side:?}: {result:?}"
            );
            assert!(decode(&none, &SMALL).is_err(), "{format} {side:?}");
        }
    }
}

/// If it counted as a picture of 0 by 0 pixels, the tracker's arithmetic would panic.
#[test]
fn a_png_without_its_header_is_a_typed_error() {
    let image: DynamicImage = color(32, 32).into();
    let mut png = encode(&image, ImageFormat::Png);
    assert_eq!(png[12..16], *b"IHDR");
    png[15] = b'H';
    let result = inspect(&png, &SMALL).map(|file| file.size());
    assert!(
        matches!(result, Err(IngestError::Damaged { format: "PNG", .. })),
        "{result:?}"
    );
}

/// Its decoder gives a side of 0 pixels, on which the tracker's arithmetic would panic.
#[test]
fn a_webp_of_the_longest_sides_is_a_typed_error() {
    let image: DynamicImage = color(32, 32).into();
    let webp = encode(&image, ImageFormat::WebP);
    assert_eq!((&webp[12..16], webp[20]), (&b"VP8L"[..], 0x2F));
    // Width and height less one, in 14 bits each behind the signature.
    for sides in [0x3FFF, 0x3FFF << 14] {
        let mut long = webp.clone();
        let bits = long[21..25].first_chunk().copied().map(u32::from_le_bytes);
        long[21..25].copy_from_slice(&(bits.unwrap() | sides).to_le_bytes());
        let result = inspect(&long, &SMALL).map(|file| file.size());
        assert!(
            matches!(result, Err(IngestError::Damaged { format: "WebP", .. })),
            "{result:?}"
        );
    }
}

/// The codes of an image in which each symbol takes no bit, and stands for a pixel that is copied.
fn write_empty_pixels(bits: &mut Bits) {
    // No colours that were seen before. A code of lengths in which 18 (a run of zeros) and 1 have one bit each; three
    // lengths follow: 138 and 118 zeros, and then the 1 of symbol 256.
    for (number, width) in [(0, 1), (0, 1), (0, 4), (0, 3), (1, 3), (0, 3), (1, 3)] {
        bits.write(number, width);
    }
    for (number, width) in [
        (1, 1),
        (0, 3),
        (1, 2),
        (1, 1),
        (127, 7),
        (1, 1),
        (107, 7),
        (0, 1),
    ] {
        bits.write(number, width);
    }
    (0..4).for_each(|_| bits.write_single_code());
}

/// Without a check of the sizes, a file of 3 KB would hold a worker for ever.
#[test]
fn a_webp_is_answered_soon_whatever_size_its_chunks_claim() {
    let image = encode(&color(64, 48).into(), ImageFormat::WebP).split_off(12);
    let mut transforms = Bits::default();
    for kind in [0, 1] {
        transforms.write(1 | kind << 1, 6);
        write_empty_pixels(&mut transforms);
    }
    transforms.write(0, 64);
    let alpha = webp_chunk(b"ALPH", &[&[1], &transforms.bytes[..]].concat());
    let mut header = Bits::default();
    // The signature, and 16,384 pixels a side.
    header.write(0x2f, 8);
    header.write((1 << 28) - 1, 32);
    let lossless = webp_chunk(b"VP8L", &[header.bytes, transforms.bytes].concat());
    let huge = animation_frame(1 << 24, &[alpha]);
    let is_taken = |chunks: &[Vec<u8>]| {
        let (file, (done, answer)) = (webp(chunks), mpsc::channel());
        std::thread::spawn(move || done.send(decode(&file, &Limits::default()).is_ok()));
        let answer = answer.recv_timeout(Duration::from_secs(60));
        answer.expect("it is answered")
    };
    assert!(is_taken(&[image.clone(), huge.clone()]));
    let many = [vec![image], vec![lossless.clone(); 10_000]].concat();
    assert!(is_taken(&many));
    let animation = [canvas(true), webp_chunk(b"ANIM", &[0; 6])];
    assert!(!is_taken(&[&animation[..], &[huge]].concat()));
    assert!(!is_taken(&[canvas(false), lossless]));
}

/// A valid file with some bytes changed, a piece dropped and a piece repeated.
fn mutated() -> impl Strategy<Value = Vec<u8>> {
    let edits = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8);
    let place = any::<prop::sample::Index>;
    (
        0..files().len(),
        edits,
        place(),
        0..40usize,
        place(),
        0..40usize,
    )
        .prop_map(|(which, edits, drop_at, dropped, repeat_at, repeated)| {
            let mut bytes = files().swap_remove(which).1;
            for (at, value) in edits {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            let from = drop_at.index(bytes.len());
            bytes.drain(from..(from + dropped).min(bytes.len()));
            let from = repeat_at.index(bytes.len());
            let piece = bytes[from..(from + repeated).min(bytes.len())].to_vec();
            bytes.splice(from..from, piece);
            bytes
        })
}

/// Whatever the bytes are, the result is an error or a frame within the limits.
fn check(bytes: &[u8]) {
    if let Ok(frame) = decode(bytes, &SMALL) {
        let (width, height) = frame.source_size();
        assert!(width <= SMALL.max_side && height <= SMALL.max_side);
        assert!(u64::from(width) * u64::from(height) <= SMALL.max_pixels);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn mutated_files_never_panic(bytes in mutated()) {
        check(&bytes);
    }

    #[test]
    fn random_bytes_behind_a_signature_never_panic(
        signature in prop::sample::select(vec![
            b"\xFF\xD8\xFF".to_vec(),
            b"\x89PNG\r\n\x1a\n".to_vec(),
            b"RIFF\x40\0\0\0WEBPVP8 ".to_vec(),
            b"RIFF\x40\0\0\0WEBPVP8L".to_vec(),
            b"RIFF\x40\0\0\0WEBPVP8X".to_vec(),
        ]),
        rest in prop::collection::vec(any::<u8>(), 0..400),
    ) {
        check(&[signature, rest].concat());
    }
}
