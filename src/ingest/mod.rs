//! Uploaded bytes to a working image. What could go wrong: bytes are hostile. They may claim to be huge,
//! be cut short, or cost far more to decode than to send; so the whole structure is read and everything is
//! limited before a pixel is decoded.
//!
//! What a frame becomes:
//! - *Type*: by the bytes alone (JPEG, PNG, WebP), never by a name or a header of the request.
//! - *Whole*: a file that ends before its own end marker is an error, also where the decoder would guess the rest.
//! - *Luma*: Rec. 601, `Y = 0.299 R + 0.587 G + 0.114 B`, rounded: for JPEG this is its own Y channel, decoded
//!   without the detour over colour. Colour profiles and gamma are not applied. 16 bits are rounded to 8.
//!   Transparency is blended over black, as a canvas does when it writes a JPEG.
//! - *Upright*: the EXIF orientation of a JPEG, PNG or WebP is applied, so boxes are in the pixels that a browser shows.
//! - *Animations*: the first image.
//!
//! With the feature `turbo`, libjpeg-turbo decodes the usual JPEGs, already reduced where they are large. It only says yes:
//! whatever it warns of, or does not take, is decided by the default decoder, so the same files are errors.
//!
//! ```
//! use bagtrack::ingest::{decode, IngestError, Limits};
//! let error = decode(b"GIF89a", &Limits::default()).unwrap_err();
//! assert_eq!(error, IngestError::UnknownFormat);
//! ```

mod containers;
mod guard;
mod jpeg;
mod jpeg_markers;
mod limits;
mod luma;
mod orientation;
mod picture;
mod plain;
mod raster;
mod sniff;
#[cfg(feature = "turbo")]
mod turbo;

pub use limits::Limits;
pub use plain::plain_size;

use crate::tracker::GrayFrame;
use picture::Room;
use sniff::Format;
use std::cell::RefCell;

thread_local! {
    static ROOM: RefCell<Room> = RefCell::default();
}

/// Why bytes are not a frame.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum IngestError {
    /// The bytes are none of JPEG, PNG, WebP.
    #[error("the bytes are not a JPEG, PNG or WebP image")]
    UnknownFormat,
    /// The frame is over one of the limits; the text names it, with both numbers.
    #[error("{0}")]
    TooLarge(String),
    /// The image is damaged or cut short; the text says what the decoder found.
    #[error("the {format} image cannot be decoded: {reason}")]
    Damaged {
        /// JPEG, PNG or WebP.
        format: &'static str,
        /// What is wrong with it.
        reason: String,
    },
}

/// Decodes one uploaded frame: sniff, limit, decode strictly, luma, EXIF orientation, downscale.
///
/// Costs at most [`Limits::max_memory`] bytes beside the upload itself and the working image. A thread keeps some of that
/// for its next frame, at most 32 MiB.
///
/// # Errors
/// See [`IngestError`].
pub fn decode(bytes: &[u8], limits: &Limits) -> Result<GrayFrame, IngestError> {
    limits.check_bytes(bytes.len())?;
    let format = sniff::format(bytes).ok_or(IngestError::UnknownFormat)?;
    guard::unless_it_panics(format, || {
        ROOM.with_borrow_mut(|room| {
            let working = std::mem::take(&mut room.working);
            let picture = match format {
                Format::Jpeg => jpeg::decode(bytes, limits, room)?,
                Format::Png => raster::decode_png(bytes, limits)?,
                Format::WebP => raster::decode_webp(bytes, limits)?,
            };
            let frame = picture.into_frame(working);
            room.trim();
            frame.map_err(|error| format.damaged(error.to_string()))
        })
    })
}

/// Takes the memory of a frame that is done with, for the next one that this thread decodes.
pub fn recycle(frame: GrayFrame) {
    ROOM.with_borrow_mut(|room| room.working = frame.into_pixels());
}
