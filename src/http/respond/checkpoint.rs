//! The header `Checkpoint: N` of an answer: with a store, the last frame whose state is in it.

use axum::http::{HeaderName, HeaderValue};
use axum::response::Response;

const CHECKPOINT: HeaderName = HeaderName::from_static("checkpoint");

/// Adds the header, where there is a store.
pub fn with_checkpoint(checkpoint: Option<u64>, mut response: Response) -> Response {
    if let Some(frame) = checkpoint {
        let headers = response.headers_mut();
        headers.insert(CHECKPOINT, HeaderValue::from(frame));
    }
    response
}
