//! Faults of the decoders by themselves, which ingest guards against. If a test fails, the fault is mended: the
//! document in `docs/upstream` then says which guard can go.

use crate::memory::with_code_groups;
use bagtrack_testing::picture_files::{BASELINE, JpegForm, color, jpeg};
use image_webp::{DecodingError, WebPDecoder};
use std::io::Cursor;
use zune_core::bytestream::ZCursor;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

#[test]
fn image_webp_alone_takes_more_memory_than_its_limit() {
    const LIMIT: usize = 1 << 20;
    let file = with_code_groups(2_000);
    let mut decoder = WebPDecoder::new(Cursor::new(&file)).expect("a WebP");
    decoder.set_memory_limit(LIMIT);
    let mut pixels = vec![0; decoder.output_buffer_size().expect("a size")];
    let mut decoded = Ok(());
    let used = allocation_counter::measure(|| decoded = decoder.read_image(&mut pixels));
    println!("{} of {LIMIT} bytes, {decoded:?}", used.bytes_max);
    assert!(!matches!(decoded, Err(DecodingError::MemoryLimitExceeded)));
    assert!(used.bytes_max > 16 * LIMIT as u64);
}

#[test]
fn zune_jpeg_alone_takes_a_picture_without_its_end() {
    let forms = [None, Some(6)].map(|scans| [None, Some(4)].map(|restart| (scans, restart)));
    for (scans, restart) in forms.into_iter().flatten() {
        let form = JpegForm {
            scans,
            restart,
            ..BASELINE
        };
        let whole = jpeg(&color(96, 64), form, None);
        decode(&whole).expect("it is whole");
        let data = whole.windows(2).rposition(|two| two == [0xFF, 0xDA]);
        let data = data.expect("a scan") + 32;
        for cut in (data..whole.len() - 8).step_by(7) {
            // Not between the two bytes of a marker.
            if whole[cut - 1] != 0xFF {
                let cut = [&whole[..cut], &[0xFF, 0xD9]].concat();
                decode(&cut).expect("blocks that are missing are gray");
            }
        }
    }
}

fn decode(file: &[u8]) -> Result<Vec<u8>, String> {
    let options = DecoderOptions::new_fast().set_strict_mode(true);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(file), options);
    decoder.decode().map_err(|error| format!("{error:?}"))
}
