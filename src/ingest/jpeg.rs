//! JPEG, decoded strictly and straight to luma.

use super::jpeg_markers::Markers;
use super::luma::luma_of_rgb8;
use super::orientation;
use super::picture::{Picture, Room};
use super::sniff::Format;
use super::{IngestError, Limits};
use std::borrow::Cow;
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;

/// More scans than any encoder writes: each one walks the whole picture again.
pub(super) const MAX_SCANS: usize = 64;

pub(super) fn decode<'room>(
    bytes: &[u8],
    limits: &Limits,
    room: &'room mut Room,
) -> Result<Picture<'room>, IngestError> {
    let damaged = |reason: &str| Format::Jpeg.damaged(reason);
    let markers = Markers::read(bytes).map_err(damaged)?;
    limits.check_size(markers.width, markers.height)?;
    if markers.is_implausibly_small() {
        return Err(damaged("it holds less data than its size needs"));
    }
    let source = (markers.width, markers.height);
    let orientation = orientation::of_exif(markers.exif(bytes));
    #[cfg(feature = "turbo")]
    if let Some(size) = super::turbo::decode(bytes, &markers, limits, &mut room.pixels) {
        return Ok(Picture {
            luma: Cow::Borrowed(&room.pixels[..size.0 as usize * size.1 as usize]),
            size,
            source,
            orientation,
        });
    }
    Ok(Picture {
        luma: decode_whole(bytes, &markers, limits, room)?,
        size: source,
        source,
        orientation,
    })
}

/// The luma in full size, with zune-jpeg.
fn decode_whole<'room>(
    bytes: &[u8],
    markers: &Markers,
    limits: &Limits,
    room: &'room mut Room,
) -> Result<Cow<'room, [u8]>, IngestError> {
    let damaged = |reason: &str| Format::Jpeg.damaged(reason);
    // Most of the decoder's texts come in quotes.
    let reason = |error: DecodeErrors| damaged(error.to_string().trim_matches('"'));
    let guarded = &mut room.file;
    markers.with_guarded_end(bytes, guarded);
    let options = DecoderOptions::new_fast()
        .set_strict_mode(true)
        .set_max_width(limits.max_side as usize)
        .set_max_height(limits.max_side as usize)
        .jpeg_set_max_scans(MAX_SCANS)
        .jpeg_set_out_colorspace(ColorSpace::Luma);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(&guarded[..]), options);
    decoder.decode_headers().map_err(reason)?;
    let info = decoder.info().expect("the headers were decoded just now");
    if (u32::from(info.width), u32::from(info.height)) != (markers.width, markers.height) {
        return Err(damaged("its headers contradict each other"));
    }
    let stored = decoder.input_colorspace();
    if let Some(reason) = markers.unsupported(stored == Some(ColorSpace::CMYK)) {
        return Err(damaged(reason));
    }
    let output = match stored {
        Some(ColorSpace::YCbCr) if !markers.can_skip_color() => ColorSpace::YCbCr,
        Some(ColorSpace::YCbCr | ColorSpace::Luma) => ColorSpace::Luma,
        // RGB and CMYK have no Y channel to take.
        _ => ColorSpace::RGB,
    };
    limits
        .check_memory(markers.memory(output.num_components() as u64 + 1) + guarded.len() as u64)?;
    decoder.set_options(options.jpeg_set_out_colorspace(output));
    let bytes = decoder
        .output_buffer_size()
        .ok_or_else(|| damaged("its size is unknown"))?;
    // The decoder may leave values out of a damaged file: they must not be those of the frame before.
    room.pixels.clear();
    room.pixels.resize(bytes, 0);
    decoder.decode_into(&mut room.pixels).map_err(reason)?;
    Ok(match output {
        ColorSpace::Luma => Cow::Borrowed(&room.pixels[..]),
        ColorSpace::YCbCr => room.pixels.iter().copied().step_by(3).collect(),
        _ => Cow::Owned(luma_of_rgb8(&room.pixels)),
    })
}
