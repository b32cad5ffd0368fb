//! A last guard around the decoders: they index by what a hostile file says, and a panic in one of them is that
//! file's fault, not ours.

use super::IngestError;
use super::sniff::Format;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs a decoder, with a panic in it turned into an error.
pub(super) fn unless_it_panics<T>(
    format: Format,
    decode: impl FnOnce() -> Result<T, IngestError>,
) -> Result<T, IngestError> {
    // What `decode` borrows is dropped by the callers on an error, so nobody sees it half changed.
    catch_unwind(AssertUnwindSafe(decode))
        .unwrap_or_else(|_| Err(format.damaged("its structure is not supported")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_damaged_image() {
        let result: Result<(), IngestError> = unless_it_panics(Format::WebP, || {
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
