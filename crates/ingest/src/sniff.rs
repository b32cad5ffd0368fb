//! The type of an image, by its first bytes.

use super::error::IngestError;

/// The image types that are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    Jpeg,
    Png,
    WebP,
}

impl Format {
    fn name(self) -> &'static str {
        match self {
            Format::Jpeg => "JPEG",
            Format::Png => "PNG",
            Format::WebP => "WebP",
        }
    }

    /// The error for an image of this type that cannot be decoded.
    pub(super) fn damaged(self, reason: impl Into<String>) -> IngestError {
        IngestError::Damaged {
            format: self.name(),
            reason: reason.into(),
        }
    }
}

/// The type that the signature at the start of `bytes` tells, if it is one of ours.
pub(super) fn format(bytes: &[u8]) -> Option<Format> {
    if bytes.starts_with(&[0xFF, 0xD8, 0xFF]) {
        Some(Format::Jpeg)
    } else if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        Some(Format::Png)
    } else if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
        Some(Format::WebP)
    } else {
        None
    }
}
