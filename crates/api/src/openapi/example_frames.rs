//! Two frames for the examples of the document, cut from the sample clip: the target of the first is at `10,20,30,40`.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// The first frame as base64.
pub fn first() -> String {
    STANDARD.encode(include_bytes!("first.jpg"))
}

/// A later frame as base64.
pub fn next() -> String {
    STANDARD.encode(include_bytes!("next.jpg"))
}
