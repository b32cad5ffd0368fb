//! Reading a request body, and the problem that a failure is.

use crate::http::problems::problem::Problem;
use axum::body::{Body, Bytes};
use axum::extract::multipart::MultipartError;
use axum::http::StatusCode;
use http_body_util::{BodyExt, LengthLimitError, Limited};
use std::error::Error;
use tower_http::timeout::TimeoutError;

/// Reads the whole body, of at most `max_bytes` bytes.
///
/// # Errors
/// It is too large, too slow or cut short.
pub(super) async fn read(body: Body, max_bytes: usize) -> Result<Bytes, Problem> {
    match Limited::new(body, max_bytes).collect().await {
        Ok(collected) => Ok(collected.to_bytes()),
        Err(error) => Err(problem(error.as_ref(), max_bytes)),
    }
}

/// The problem that an error of reading a body is, or of parsing it as it comes. The reason is somewhere in the chain
/// of its causes.
pub(super) fn problem(error: &(dyn Error + 'static), max_bytes: usize) -> Problem {
    let mut cause = Some(error);
    while let Some(error) = cause {
        if error.is::<LengthLimitError>() {
            return Problem::body_too_large(max_bytes);
        }
        if error.is::<TimeoutError>() {
            return Problem::body_timeout();
        }
        if let Some(error) = error.downcast_ref::<MultipartError>()
            && error.status().is_client_error()
            && error.status() != StatusCode::PAYLOAD_TOO_LARGE
        {
            return Problem::malformed(format!(
                "The multipart form cannot be read: {}.",
                error.body_text()
            ));
        }
        cause = error.source();
    }
    Problem::malformed("The body ended before its announced length; send it again.")
}
