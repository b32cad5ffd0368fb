//! The steps from bytes to a frame: sniff, limit, decode strictly, luma, EXIF orientation, downscale.

use super::catch_decoder_panic::catch_decoder_panic;
use super::error::IngestError;
use super::limits::Limits;
use super::scratch::Scratch;
use super::sniff::{self, Format};
use super::{jpeg, raster};
use crate::tracker::GrayFrame;
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
    let format = sniff::format(bytes).ok_or(IngestError::UnknownFormat)?;
    catch_decoder_panic(format, || match format {
        Format::Jpeg => jpeg::size(bytes, limits),
        Format::Png => raster::size_of_png(bytes, limits),
        Format::WebP => raster::size_of_webp(bytes, limits),
    })
}

/// Decodes one uploaded frame.
///
/// Allocates at most [`Limits::max_memory`] bytes beside the upload itself and the working image. A thread keeps some
/// of them for its next frame, at most 32 MiB.
///
/// # Errors
/// See [`IngestError`].
pub fn decode(bytes: &[u8], limits: &Limits) -> Result<GrayFrame, IngestError> {
    limits.check_bytes(bytes.len())?;
    let format = sniff::format(bytes).ok_or(IngestError::UnknownFormat)?;
    catch_decoder_panic(format, || {
        SCRATCH.with_borrow_mut(|scratch| {
            let working = std::mem::take(&mut scratch.working);
            let stored = match format {
                Format::Jpeg => jpeg::decode(bytes, limits, scratch)?,
                Format::Png => raster::decode_png(bytes, limits)?,
                Format::WebP => raster::decode_webp(bytes, limits)?,
            };
            let frame = stored.into_frame(working);
            scratch.trim();
            frame.map_err(|error| format.damaged(error.to_string()))
        })
    })
}

/// Keeps the memory of a frame that is no longer needed, for the next one that this thread decodes.
pub fn recycle(frame: GrayFrame) {
    SCRATCH.with_borrow_mut(|scratch| scratch.working = frame.into_pixels());
}
