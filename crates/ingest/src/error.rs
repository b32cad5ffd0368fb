//! Why bytes are not a frame.

/// Why bytes are not a frame.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum IngestError {
    /// The bytes are none of JPEG, PNG, WebP.
    #[error("the bytes are not a JPEG, PNG or WebP image")]
    UnknownFormat,
    /// The bytes are an image of this type, which is not read.
    #[error("{0} images are not read")]
    UnreadFormat(&'static str),
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
