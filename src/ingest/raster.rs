//! PNG and WebP, through the `image` crate.

use super::containers::{check_png_whole, check_webp_whole};
use super::error::IngestError;
use super::limits::Limits;
use super::luma::luma_of;
use super::sniff::Format;
use super::stored_luma::StoredLuma;
use image::codecs::png::PngDecoder;
use image::codecs::webp::WebPDecoder;
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageError};
use std::borrow::Cow;
use std::io::Cursor;

pub(super) fn decode_png(
    bytes: &[u8],
    limits: &Limits,
) -> Result<StoredLuma<'static>, IngestError> {
    check_png_whole(bytes).map_err(|reason| Format::Png.damaged(reason))?;
    // Also bounds compressed side chunks (text, colour profiles), which are read with the header.
    let mut decoder_limits = image::Limits::no_limits();
    decoder_limits.max_alloc = Some(limits.max_memory);
    let decoder = PngDecoder::with_limits(Cursor::new(bytes), decoder_limits)
        .map_err(|error| typed(Format::Png, error))?;
    decode(decoder, Format::Png, 0, limits)
}

pub(super) fn decode_webp(
    bytes: &[u8],
    limits: &Limits,
) -> Result<StoredLuma<'static>, IngestError> {
    check_webp_whole(bytes).map_err(|reason| Format::WebP.damaged(reason))?;
    let decoder =
        WebPDecoder::new(Cursor::new(bytes)).map_err(|error| typed(Format::WebP, error))?;
    // The decoder needs its planes, or an RGBA copy where the image has no alpha.
    decode(decoder, Format::WebP, 4, limits)
}

fn decode(
    mut decoder: impl ImageDecoder,
    format: Format,
    working_bytes_per_pixel: u64,
    limits: &Limits,
) -> Result<StoredLuma<'static>, IngestError> {
    let (width, height) = decoder.dimensions();
    limits.check_size(width, height)?;
    // The decoded image, what the decoder needs beside it, and the luma.
    let pixels = u64::from(width) * u64::from(height);
    limits.check_memory(decoder.total_bytes() + (working_bytes_per_pixel + 1) * pixels)?;
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let image = DynamicImage::from_decoder(decoder).map_err(|error| typed(format, error))?;
    let luma = luma_of(image);
    let size = luma.dimensions();
    Ok(StoredLuma {
        luma: Cow::Owned(luma.into_raw()),
        size,
        source: size,
        orientation,
    })
}

fn typed(format: Format, error: ImageError) -> IngestError {
    match error {
        ImageError::Limits(error) => IngestError::TooLarge(format!(
            "the frame needs more memory than it may have: {error}"
        )),
        other => format.damaged(other.to_string()),
    }
}
