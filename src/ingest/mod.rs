//! Uploaded bytes to a working image. What could go wrong: bytes are hostile. They may claim to be huge,
//! be cut short, or cost far more to decode than to send; so everything is limited before decoding.

use crate::tracker::GrayFrame;

/// What an upload may cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Most bytes of one encoded frame.
    pub max_bytes: usize,
    /// Longest side in pixels.
    pub max_side: u32,
    /// Most pixels (width x height).
    pub max_pixels: u64,
    /// Most memory, in bytes, that decoding may allocate.
    pub max_memory: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_bytes: 16 << 20,
            max_side: 8192,
            max_pixels: 40_000_000,
            max_memory: 256 << 20,
        }
    }
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
/// # Errors
/// See [`IngestError`].
pub fn decode(_bytes: &[u8], _limits: &Limits) -> Result<GrayFrame, IngestError> {
    todo!()
}
