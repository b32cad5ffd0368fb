//! The steps from bytes to a frame: sniff, limit, decode strictly, luma and chroma, EXIF orientation, downscale.

use super::catch_decoder_panic::catch_decoder_panic;
use super::error::IngestError;
use super::limits::Limits;
use super::scratch::Scratch;
use super::sniff::{self, Format};
use super::{jpeg, raster};
use bagtrack_tracker::{Frame, FrameFormat};
use std::cell::RefCell;

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// Width and height of an uploaded frame as it is shown. Only the file's structure is read: no pixel is decoded.
///
/// # Errors
/// See [`IngestError`]. Bytes that pass may still fail to decode.
pub fn size(bytes: &[u8], limits: &Limits) -> Result<(u32, u32), IngestError> {
    limits.check_bytes(bytes.len())?;
    let format = sniff::format(bytes).ok_or_else(|| unread(bytes))?;
    catch_decoder_panic(format, || match format {
        Format::Jpeg => jpeg::size(bytes, limits),
        Format::Png => raster::size_of_png(bytes, limits),
        Format::WebP => raster::size_of_webp(bytes, limits),
    })
}

fn unread(bytes: &[u8]) -> IngestError {
    sniff::unread_type(bytes).map_or(IngestError::UnknownFormat, IngestError::UnreadFormat)
}

/// Decodes one uploaded frame in its own size, in colour where it has any.
///
/// # Errors
/// See [`IngestError`].
pub fn decode(bytes: &[u8], limits: &Limits) -> Result<Frame, IngestError> {
    let whole = |size| FrameFormat {
        size,
        has_color: true,
    };
    decode_to(bytes, limits, &whole)
}

/// Decodes one uploaded frame in the format that a session wants: `format` says it from the upload's width and height.
/// A frame that is smaller than that stays as it is.
///
/// Allocates at most [`Limits::max_memory`] bytes beside the upload itself and the frame. A thread keeps some of them
/// for its next frame, at most 32 MiB.
///
/// # Errors
/// See [`IngestError`].
pub fn decode_to(
    bytes: &[u8],
    limits: &Limits,
    format: &dyn Fn((u32, u32)) -> FrameFormat,
) -> Result<Frame, IngestError> {
    limits.check_bytes(bytes.len())?;
    let file = sniff::format(bytes).ok_or_else(|| unread(bytes))?;
    catch_decoder_panic(file, || {
        SCRATCH.with_borrow_mut(|scratch| {
            let planes = std::mem::take(&mut scratch.planes);
            let (stored, format) = match file {
                Format::Jpeg => jpeg::decode(bytes, limits, format, scratch)?,
                Format::Png => raster::decode_png(bytes, limits, format)?,
                Format::WebP => raster::decode_webp(bytes, limits, format)?,
            };
            let frame = stored.into_frame(format, planes);
            scratch.trim();
            frame.map_err(|error| file.damaged(error.to_string()))
        })
    })
}

/// Keeps the memory of a frame that is no longer needed, for the next one that this thread decodes.
pub fn recycle(frame: Frame) {
    SCRATCH.with_borrow_mut(|scratch| scratch.planes = frame.into_planes());
}
