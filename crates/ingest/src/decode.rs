//! The steps from bytes to a frame: sniff the type, read the structure, check the limits; then decode strictly, take
//! luma and chroma, turn upright by the EXIF orientation, and downscale.

use super::error::IngestError;
use super::jpeg::Jpeg;
use super::limits::Limits;
use super::png_chunks::Png;
use super::raster::{self, WebPFile};
use super::sniff::{self, Format};
use super::stored_image::{Scratch, orientation_of, upright_size};
use bagtrack_tracker::{Frame, FrameFormat};
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// An uploaded file whose structure was read: it is a JPEG, PNG or WebP, whole as far as that shows, and within the
/// limits. No pixel was decoded.
pub struct Inspected<'file> {
    file: File<'file>,
    limits: Limits,
}

enum File<'file> {
    Jpeg(Jpeg<'file>),
    Png(Png<'file>),
    WebP(Box<WebPFile<'file>>),
}

/// Reads the structure of an uploaded file.
///
/// # Errors
/// See [`IngestError`]. Bytes that pass may still fail to decode.
pub fn inspect<'file>(
    bytes: &'file [u8],
    limits: &Limits,
) -> Result<Inspected<'file>, IngestError> {
    limits.check_bytes(bytes.len())?;
    let format = sniff::format(bytes).ok_or_else(|| unread(bytes))?;
    let file = catch_decoder_panic(format, || {
        Ok(match format {
            Format::Jpeg => File::Jpeg(Jpeg::read(bytes, limits)?),
            Format::Png => File::Png(raster::read_png(bytes, limits)?),
            Format::WebP => File::WebP(Box::new(WebPFile::read(bytes, limits)?)),
        })
    })?;
    let limits = *limits;
    Ok(Inspected { file, limits })
}

fn unread(bytes: &[u8]) -> IngestError {
    sniff::unread_type(bytes)
        .or_else(|| sniff::is_base64(bytes).then_some("base64"))
        .or_else(|| sniff::is_text(bytes).then_some("text"))
        .map_or(IngestError::UnknownFormat, IngestError::UnreadFormat)
}

impl Inspected<'_> {
    /// Width and height of the upright image.
    pub fn size(&self) -> (u32, u32) {
        match &self.file {
            File::Jpeg(jpeg) => jpeg.size(),
            File::Png(png) => upright_size(png.size, orientation_of(png.exif)),
            File::WebP(webp) => webp.size(),
        }
    }

    /// Decodes the file in the format that a session wants. A smaller image is not enlarged.
    ///
    /// Allocates at most [`Limits::max_memory`] bytes besides the upload itself and the frame. A thread keeps some of
    /// these buffers for its next frame.
    ///
    /// # Errors
    /// See [`IngestError`].
    pub fn decode(self, format: FrameFormat) -> Result<Frame, IngestError> {
        let (kind, limits) = (self.file.kind(), &self.limits);
        catch_decoder_panic(kind, || {
            SCRATCH.with_borrow_mut(|scratch| {
                let planes = std::mem::take(&mut scratch.planes);
                let stored = match self.file {
                    File::Jpeg(jpeg) => jpeg.decode(limits, format, scratch)?,
                    File::Png(png) => raster::decode_png(&png, limits, format)?,
                    File::WebP(webp) => webp.decode(limits, format)?,
                };
                let frame = stored.into_frame(format, planes);
                scratch.trim();
                frame.map_err(|error| kind.damaged(error.to_string()))
            })
        })
    }
}

impl File<'_> {
    fn kind(&self) -> Format {
        match self {
            File::Jpeg(_) => Format::Jpeg,
            File::Png(_) => Format::Png,
            File::WebP(_) => Format::WebP,
        }
    }
}

/// Decodes one uploaded frame in its own size, in colour where it has any.
///
/// # Errors
/// See [`IngestError`].
pub fn decode(bytes: &[u8], limits: &Limits) -> Result<Frame, IngestError> {
    let file = inspect(bytes, limits)?;
    let size = file.size();
    file.decode(FrameFormat {
        size,
        has_color: true,
    })
}

/// Decodes one uploaded frame as [`Inspected::decode`] does. `format` gives the format for the upload's width and
/// height.
///
/// # Errors
/// See [`IngestError`].
pub fn decode_to(
    bytes: &[u8],
    limits: &Limits,
    format: &dyn Fn((u32, u32)) -> FrameFormat,
) -> Result<Frame, IngestError> {
    let file = inspect(bytes, limits)?;
    let format = format(file.size());
    file.decode(format)
}

/// Keeps the memory of a frame that is no longer needed, for the next one that this thread decodes.
pub fn recycle(frame: Frame) {
    SCRATCH.with_borrow_mut(|scratch| scratch.planes = frame.into_planes());
}

/// Runs a decoder, with a panic in it turned into an error: decoders index by numbers that a hostile file holds. The
/// file is damaged then, and the service goes on.
fn catch_decoder_panic<T>(
    format: Format,
    decode: impl FnOnce() -> Result<T, IngestError>,
) -> Result<T, IngestError> {
    // Whatever `decode` borrows is dropped or overwritten after an error, so no half-changed value is read.
    catch_unwind(AssertUnwindSafe(decode))
        .unwrap_or_else(|_| Err(format.damaged("its structure is not supported")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_damaged_image() {
        let result: Result<(), IngestError> = catch_decoder_panic(Format::WebP, || {
            let nothing: [u8; 0] = [];
            let index = std::hint::black_box(3);
            Err(Format::WebP.damaged(nothing[index..].len().to_string()))
        });
        let error = result.expect_err("it panicked");
        assert_eq!(
            error.to_string(),
            "the WebP image cannot be decoded: its structure is not supported"
        );
    }
}
