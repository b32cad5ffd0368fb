//! What one frame may cost. The limits are checked against the header's claims, before anything is allocated for the
//! frame.

use super::error::IngestError;

/// More scans than any JPEG encoder writes. Each scan costs a pass over the whole image.
pub(super) const MAX_JPEG_SCANS: usize = 64;

/// What one frame may cost.
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

impl Limits {
    pub(super) fn check_bytes(&self, bytes: usize) -> Result<(), IngestError> {
        if bytes > self.max_bytes {
            return Err(IngestError::TooLarge(format!(
                "the frame has {bytes} bytes; at most {} are taken",
                self.max_bytes
            )));
        }
        Ok(())
    }

    pub(super) fn check_size(&self, width: u32, height: u32) -> Result<(), IngestError> {
        let side = width.max(height);
        if side > self.max_side {
            return Err(IngestError::TooLarge(format!(
                "the frame is {width} x {height}; its longer side may have at most {} pixels",
                self.max_side
            )));
        }
        let pixels = u64::from(width) * u64::from(height);
        if pixels > self.max_pixels {
            return Err(IngestError::TooLarge(format!(
                "the frame has {pixels} pixels; at most {} are taken",
                self.max_pixels
            )));
        }
        Ok(())
    }

    pub(super) fn check_memory(&self, bytes: u64) -> Result<(), IngestError> {
        if bytes > self.max_memory {
            return Err(IngestError::TooLarge(format!(
                "decoding the frame takes {bytes} bytes of memory; at most {} are given",
                self.max_memory
            )));
        }
        Ok(())
    }
}
