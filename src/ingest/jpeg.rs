//! JPEG, decoded strictly and straight to luma.

use super::jpeg_markers::Markers;
use super::luma::luma_of_rgb8;
use super::orientation;
use super::sniff::Format;
use super::{IngestError, Limits};
use image::GrayImage;
use image::metadata::Orientation;
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;

/// More scans than any encoder writes: each one walks the whole picture again.
const MAX_SCANS: usize = 64;

pub(super) fn decode(
    bytes: &[u8],
    limits: &Limits,
) -> Result<(GrayImage, Orientation), IngestError> {
    let damaged = |reason: String| Format::Jpeg.damaged(reason);
    // Most of the decoder's texts come in quotes.
    let reason = |error: DecodeErrors| damaged(error.to_string().trim_matches('"').to_owned());
    let markers = Markers::read(bytes).map_err(|reason| damaged(reason.to_owned()))?;
    limits.check_size(markers.width, markers.height)?;
    if markers.is_implausibly_small() {
        return Err(damaged("it holds less data than its size needs".to_owned()));
    }

    let guarded = markers.with_guarded_end(bytes);
    let options = DecoderOptions::new_fast()
        .set_strict_mode(true)
        .set_max_width(limits.max_side as usize)
        .set_max_height(limits.max_side as usize)
        .jpeg_set_max_scans(MAX_SCANS)
        .jpeg_set_out_colorspace(ColorSpace::Luma);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(&guarded[..]), options);
    decoder.decode_headers().map_err(reason)?;
    let info = decoder.info().expect("the headers were decoded just now");
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    if (width, height) != (markers.width, markers.height) {
        return Err(damaged("its headers contradict each other".to_owned()));
    }
    let stored = decoder.input_colorspace();
    if let Some(reason) = markers.unsupported(stored == Some(ColorSpace::CMYK)) {
        return Err(damaged(reason.to_owned()));
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
    let pixels = decoder.decode().map_err(reason)?;
    let luma = match output {
        ColorSpace::Luma => pixels,
        ColorSpace::YCbCr => pixels.into_iter().step_by(3).collect(),
        _ => luma_of_rgb8(&pixels),
    };
    let luma = GrayImage::from_raw(width, height, luma)
        .ok_or_else(|| damaged("the decoder gave too few pixels".to_owned()))?;
    Ok((luma, orientation::of_exif(info.exif_data.as_deref())))
}
