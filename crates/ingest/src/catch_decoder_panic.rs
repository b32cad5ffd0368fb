//! Decoders index by numbers that a hostile file holds. Should one of them panic, the file is damaged, and the service
//! goes on.

use super::error::IngestError;
use super::sniff::Format;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs a decoder, with a panic in it turned into an error.
pub(super) fn catch_decoder_panic<T>(
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
