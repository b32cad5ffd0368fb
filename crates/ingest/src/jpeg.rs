//! JPEG, decoded strictly, to the channels that it stores.

use super::deinterleave;
use super::error::IngestError;
use super::jpeg_markers::Markers;
use super::limits::{Limits, MAX_JPEG_SCANS};
use super::luma::luma_of_rgb8;
use super::orientation;
use super::scratch::Scratch;
use super::sniff::Format;
use super::stored_image::{Channel, StoredImage};
use bagtrack_tracker::{FrameFormat, ycbcr};
use std::borrow::Cow;
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;

/// A JPEG's luma and chroma: at full size or, with libjpeg-turbo, reduced.
pub(super) fn decode<'scratch>(
    bytes: &[u8],
    limits: &Limits,
    format: &dyn Fn((u32, u32)) -> FrameFormat,
    scratch: &'scratch mut Scratch,
) -> Result<(StoredImage<'scratch>, FrameFormat), IngestError> {
    let markers = read_markers(bytes, limits)?;
    let source = (markers.width, markers.height);
    let orientation = orientation::of_exif(markers.exif(bytes));
    let format = format(orientation::upright(source, orientation));
    let has_color = format.has_color && markers.has_usual_chroma();
    let format = FrameFormat {
        has_color,
        ..format
    };
    #[cfg(feature = "turbo")]
    {
        // Before it is turned upright, as the decoder sees it.
        let stored_format = FrameFormat {
            size: orientation::upright(format.size, orientation),
            ..format
        };
        let pixels = &mut scratch.pixels;
        if let Some(planes) = super::turbo::decode(bytes, &markers, limits, stored_format, pixels) {
            let stored = planes.of(&scratch.pixels, source, orientation);
            return Ok((stored, format));
        }
    }
    let (luma, chroma) = decode_whole(bytes, &markers, limits, format.has_color, scratch)?;
    let channel = |values, size| Channel { values, size };
    let half = ycbcr::chroma_size(source);
    let stored = StoredImage {
        luma: channel(luma, source),
        chroma: chroma.map(|planes| planes.map(|plane| channel(Cow::Owned(plane), half))),
        source,
        orientation,
    };
    Ok((stored, format))
}

/// Width and height of a JPEG as it is shown.
pub(super) fn size(bytes: &[u8], limits: &Limits) -> Result<(u32, u32), IngestError> {
    let markers = read_markers(bytes, limits)?;
    let orientation = orientation::of_exif(markers.exif(bytes));
    Ok(orientation::upright(
        (markers.width, markers.height),
        orientation,
    ))
}

fn read_markers(bytes: &[u8], limits: &Limits) -> Result<Markers, IngestError> {
    let damaged = |reason: &str| Format::Jpeg.damaged(reason);
    let markers = Markers::read(bytes).map_err(damaged)?;
    // A height of 0 would be told after the first scan; no decoder here reads that.
    if markers.width == 0 || markers.height == 0 {
        return Err(damaged("its width or its height is 0"));
    }
    limits.check_size(markers.width, markers.height)?;
    if markers.is_implausibly_small() {
        return Err(damaged("it holds less data than its size needs"));
    }
    Ok(markers)
}

/// Luma and, where it is wanted, chroma in half of its columns and rows.
type Channels<'a> = (Cow<'a, [u8]>, Option<[Vec<u8>; 2]>);

/// The channels at full size, with zune-jpeg.
fn decode_whole<'scratch>(
    bytes: &[u8],
    markers: &Markers,
    limits: &Limits,
    has_color: bool,
    scratch: &'scratch mut Scratch,
) -> Result<Channels<'scratch>, IngestError> {
    let damaged = |reason: &str| Format::Jpeg.damaged(reason);
    // Most of the decoder's messages come in quotes.
    let reason = |error: DecodeErrors| damaged(error.to_string().trim_matches('"'));
    let guarded = &mut scratch.file;
    markers.with_guarded_end(bytes, guarded);
    let options = DecoderOptions::new_fast()
        .set_strict_mode(true)
        .set_max_width(limits.max_side as usize)
        .set_max_height(limits.max_side as usize)
        .jpeg_set_max_scans(MAX_JPEG_SCANS)
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
        Some(ColorSpace::YCbCr) if has_color || !markers.can_skip_color() => ColorSpace::YCbCr,
        Some(ColorSpace::YCbCr | ColorSpace::Luma) => ColorSpace::Luma,
        // RGB and CMYK have no Y channel to take.
        _ => ColorSpace::RGB,
    };
    limits
        .check_memory(markers.memory(output.num_components() as u64 + 2) + guarded.len() as u64)?;
    decoder.set_options(options.jpeg_set_out_colorspace(output));
    let bytes = decoder
        .output_buffer_size()
        .ok_or_else(|| damaged("its size is unknown"))?;
    // The decoder may leave pixels of a damaged file unwritten. They must not show the frame before.
    scratch.pixels.clear();
    scratch.pixels.resize(bytes, 0);
    decoder.decode_into(&mut scratch.pixels).map_err(reason)?;
    let size = (markers.width, markers.height);
    let pixels = scratch.pixels.as_chunks::<3>().0;
    Ok(match output {
        ColorSpace::Luma => (Cow::Borrowed(&scratch.pixels[..]), None),
        ColorSpace::YCbCr if has_color => {
            let (luma, chroma) = deinterleave::planes(&scratch.pixels, size);
            (Cow::Owned(luma), Some(chroma))
        }
        ColorSpace::YCbCr => (pixels.iter().map(|pixel| pixel[0]).collect(), None),
        _ => {
            let chroma = has_color.then(|| ycbcr::chroma(size, |i| pixels[i]));
            (Cow::Owned(luma_of_rgb8(&scratch.pixels)), chroma)
        }
    })
}
