//! PNG and WebP, through the `image` crate.

use super::containers::{Png, read_webp};
use super::error::IngestError;
use super::limits::Limits;
use super::luma::luma_of;
use super::orientation;
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
    let png = read_png(bytes, limits)?;
    let needed = png.without_side_chunks();
    let copied = match &needed {
        Cow::Borrowed(_) => 0,
        Cow::Owned(copy) => copy.len() as u64,
    };
    let mut decoder_limits = image::Limits::no_limits();
    decoder_limits.max_alloc = Some(limits.max_memory);
    let decoder = PngDecoder::with_limits(Cursor::new(&needed[..]), decoder_limits)
        .map_err(|error| typed(Format::Png, error))?;
    decode(decoder, Format::Png, 0, copied, limits)
}

pub(super) fn decode_webp(
    bytes: &[u8],
    limits: &Limits,
) -> Result<StoredLuma<'static>, IngestError> {
    let webp = read_webp(bytes).map_err(|reason| Format::WebP.damaged(reason))?;
    let decoder =
        WebPDecoder::new(Cursor::new(bytes)).map_err(|error| typed(Format::WebP, error))?;
    decode(
        decoder,
        Format::WebP,
        webp.working_bytes_per_pixel(),
        0,
        limits,
    )
}

/// Width and height of a PNG as it is shown.
pub(super) fn size_of_png(bytes: &[u8], limits: &Limits) -> Result<(u32, u32), IngestError> {
    let png = read_png(bytes, limits)?;
    let orientation = orientation::of_exif(png.exif);
    Ok(orientation::upright(png.size, orientation))
}

/// Width and height of a WebP as it is shown.
pub(super) fn size_of_webp(bytes: &[u8], limits: &Limits) -> Result<(u32, u32), IngestError> {
    read_webp(bytes).map_err(|reason| Format::WebP.damaged(reason))?;
    let mut decoder =
        WebPDecoder::new(Cursor::new(bytes)).map_err(|error| typed(Format::WebP, error))?;
    let (width, height) = decoder.dimensions();
    limits.check_size(width, height)?;
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    Ok(orientation::upright((width, height), orientation))
}

fn read_png<'a>(bytes: &'a [u8], limits: &Limits) -> Result<Png<'a>, IngestError> {
    let png = Png::read(bytes).map_err(|reason| Format::Png.damaged(reason))?;
    limits.check_size(png.size.0, png.size.1)?;
    Ok(png)
}

/// Decodes to luma. `copied` bytes were allocated already.
fn decode(
    mut decoder: impl ImageDecoder,
    format: Format,
    working_bytes_per_pixel: u64,
    copied: u64,
    limits: &Limits,
) -> Result<StoredLuma<'static>, IngestError> {
    let (width, height) = decoder.dimensions();
    limits.check_size(width, height)?;
    // The decoded image, what the decoder needs beside it, and the luma.
    let pixels = u64::from(width) * u64::from(height);
    let beside = (working_bytes_per_pixel + 1) * pixels + copied;
    limits.check_memory(decoder.total_bytes() + beside)?;
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
