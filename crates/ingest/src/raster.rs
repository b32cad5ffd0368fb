//! PNG and WebP, through the `image` crate.

use super::error::IngestError;
use super::limits::Limits;
use super::luma::{chroma_of, luma_of};
use super::png_chunks::Png;
use super::sniff::Format;
use super::stored_image::{Channel, StoredImage, orientation_of, upright_size};
use super::webp_chunks::WebP;
use bagtrack_tracker::{FrameFormat, ycbcr};
use image::codecs::png::PngDecoder;
use image::codecs::webp::WebPDecoder;
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageError};
use std::borrow::Cow;
use std::io::Cursor;

/// Walks the chunks of a PNG.
pub(super) fn read_png<'file>(
    bytes: &'file [u8],
    limits: &Limits,
) -> Result<Png<'file>, IngestError> {
    let png = Png::read(bytes).map_err(|reason| Format::Png.damaged(reason))?;
    limits.check_size(png.size.0, png.size.1)?;
    Ok(png)
}

/// The luma and chroma of a PNG.
pub(super) fn decode_png(
    png: &Png,
    limits: &Limits,
    format: FrameFormat,
) -> Result<StoredImage<'static>, IngestError> {
    let needed = png.without_side_chunks();
    let copied = match &needed {
        Cow::Borrowed(_) => 0,
        Cow::Owned(copy) => copy.len() as u64,
    };
    let mut decoder_limits = image::Limits::no_limits();
    decoder_limits.max_alloc = Some(limits.max_memory);
    let decoder = PngDecoder::with_limits(Cursor::new(&needed[..]), decoder_limits)
        .map_err(|error| typed(Format::Png, error))?;
    if decoder.dimensions() != png.size {
        return Err(Format::Png.damaged("its headers contradict each other"));
    }
    limits.check_memory(memory(&decoder) + copied)?;
    let orientation = orientation_of(png.exif);
    decode(decoder, Format::Png, orientation, format)
}

/// A WebP whose structure was read.
pub(super) struct WebPFile<'file> {
    chunks: WebP<'file>,
    decoder: WebPDecoder<Cursor<&'file [u8]>>,
    orientation: Orientation,
}

impl<'file> WebPFile<'file> {
    /// Walks the chunks.
    pub(super) fn read(bytes: &'file [u8], limits: &Limits) -> Result<Self, IngestError> {
        let chunks = WebP::read(bytes).map_err(|reason| Format::WebP.damaged(reason))?;
        let mut decoder = WebPDecoder::new(Cursor::new(chunks.file))
            .map_err(|error| typed(Format::WebP, error))?;
        let (width, height) = decoder.dimensions();
        if width == 0 || height == 0 {
            // image-webp keeps 14 bits of a lossless side, so the longest side, of 16,384 pixels, becomes 0.
            return Err(Format::WebP.damaged("its width or its height is 0, or 16384"));
        }
        limits.check_size(width, height)?;
        let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
        Ok(Self {
            chunks,
            decoder,
            orientation,
        })
    }

    /// Width and height of the upright image.
    pub(super) fn size(&self) -> (u32, u32) {
        upright_size(self.decoder.dimensions(), self.orientation)
    }

    /// Decodes luma and chroma.
    pub(super) fn decode(
        self,
        limits: &Limits,
        format: FrameFormat,
    ) -> Result<StoredImage<'static>, IngestError> {
        let (width, height) = self.decoder.dimensions();
        let beside = self.chunks.working_bytes_per_pixel() * u64::from(width) * u64::from(height);
        let pixels = memory(&self.decoder) + beside;
        limits.check_memory(pixels)?;
        let codes = self
            .chunks
            .memory_of_codes((width, height), limits.max_memory - pixels);
        let unread = "its codes cannot be read, or its images differ in size";
        let codes = codes.ok_or_else(|| Format::WebP.damaged(unread))?;
        limits.check_memory(pixels + codes)?;
        decode(self.decoder, Format::WebP, self.orientation, format)
    }
}

/// Bytes of the decoded image, of its luma, and of its chroma in half of the columns and rows.
fn memory(decoder: &impl ImageDecoder) -> u64 {
    let (width, height) = decoder.dimensions();
    decoder.total_bytes() + u64::from(width) * u64::from(height) * 3 / 2
}

fn decode(
    decoder: impl ImageDecoder,
    file: Format,
    orientation: Orientation,
    format: FrameFormat,
) -> Result<StoredImage<'static>, IngestError> {
    let source = decoder.dimensions();
    let image = DynamicImage::from_decoder(decoder).map_err(|error| typed(file, error))?;
    let chroma = format.has_color.then(|| chroma_of(&image)).flatten();
    let channel = |values, size| Channel {
        values: Cow::Owned(values),
        size,
    };
    let half = ycbcr::chroma_size(source);
    Ok(StoredImage {
        luma: channel(luma_of(image).into_raw(), source),
        chroma: chroma.map(|planes| planes.map(|plane| channel(plane, half))),
        source,
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
