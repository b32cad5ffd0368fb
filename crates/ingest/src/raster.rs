//! PNG and WebP, through the `image` crate.

use super::error::IngestError;
use super::limits::Limits;
use super::luma::{chroma_of, luma_of};
use super::orientation;
use super::png_chunks::Png;
use super::sniff::Format;
use super::stored_image::{Channel, StoredImage};
use super::webp_chunks::WebP;
use bagtrack_tracker::{FrameFormat, ycbcr};
use image::codecs::png::PngDecoder;
use image::codecs::webp::WebPDecoder;
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageError};
use std::borrow::Cow;
use std::io::Cursor;

pub(super) fn decode_png(
    bytes: &[u8],
    limits: &Limits,
    format: &dyn Fn((u32, u32)) -> FrameFormat,
) -> Result<(StoredImage<'static>, FrameFormat), IngestError> {
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
    decode(decoder, Format::Png, 0, copied, limits, format)
}

pub(super) fn decode_webp(
    bytes: &[u8],
    limits: &Limits,
    format: &dyn Fn((u32, u32)) -> FrameFormat,
) -> Result<(StoredImage<'static>, FrameFormat), IngestError> {
    let webp = WebP::read(bytes).map_err(|reason| Format::WebP.damaged(reason))?;
    let decoder =
        WebPDecoder::new(Cursor::new(bytes)).map_err(|error| typed(Format::WebP, error))?;
    limits.check_size(decoder.dimensions().0, decoder.dimensions().1)?;
    let codes = webp.memory_of_codes(decoder.dimensions());
    let codes = codes.ok_or_else(|| Format::WebP.damaged("its codes cannot be read"))?;
    let per_pixel = webp.working_bytes_per_pixel();
    decode(decoder, Format::WebP, per_pixel, codes, limits, format)
}

/// Width and height of a PNG as it is shown.
pub(super) fn size_of_png(bytes: &[u8], limits: &Limits) -> Result<(u32, u32), IngestError> {
    let png = read_png(bytes, limits)?;
    let orientation = orientation::of_exif(png.exif);
    Ok(orientation::upright(png.size, orientation))
}

/// Width and height of a WebP as it is shown.
pub(super) fn size_of_webp(bytes: &[u8], limits: &Limits) -> Result<(u32, u32), IngestError> {
    WebP::read(bytes).map_err(|reason| Format::WebP.damaged(reason))?;
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

/// Decodes to luma. `beside` bytes are allocated beside what depends on the number of pixels.
fn decode(
    mut decoder: impl ImageDecoder,
    file: Format,
    working_bytes_per_pixel: u64,
    beside: u64,
    limits: &Limits,
    format: &dyn Fn((u32, u32)) -> FrameFormat,
) -> Result<(StoredImage<'static>, FrameFormat), IngestError> {
    let (width, height) = decoder.dimensions();
    limits.check_size(width, height)?;
    // The decoded image, what the decoder needs beside it, the luma, and the chroma in half of the columns and rows.
    let pixels = u64::from(width) * u64::from(height);
    let beside = working_bytes_per_pixel * pixels + pixels * 3 / 2 + beside;
    limits.check_memory(decoder.total_bytes() + beside)?;
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let source = (width, height);
    let format = format(orientation::upright(source, orientation));
    let image = DynamicImage::from_decoder(decoder).map_err(|error| typed(file, error))?;
    let chroma = format.has_color.then(|| chroma_of(&image)).flatten();
    let channel = |values, size| Channel {
        values: Cow::Owned(values),
        size,
    };
    let half = ycbcr::chroma_size(source);
    let stored = StoredImage {
        luma: channel(luma_of(image).into_raw(), source),
        chroma: chroma.map(|planes| planes.map(|plane| channel(plane, half))),
        source,
        orientation,
    };
    Ok((stored, format))
}

fn typed(format: Format, error: ImageError) -> IngestError {
    match error {
        ImageError::Limits(error) => IngestError::TooLarge(format!(
            "the frame needs more memory than it may have: {error}"
        )),
        other => format.damaged(other.to_string()),
    }
}
