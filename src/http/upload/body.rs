//! Reading request bodies, and what it means when that fails.

use super::problem::Problem;
use axum::body::{Body, Bytes};
use http_body_util::{BodyExt, LengthLimitError, Limited};
use std::error::Error;
use tower_http::timeout::TimeoutError;

/// Reads the whole body.
pub async fn read(body: Body, limit: usize) -> Result<Bytes, Problem> {
    match Limited::new(body, limit).collect().await {
        Ok(collected) => Ok(collected.to_bytes()),
        Err(error) => Err(problem(error.as_ref(), limit)),
    }
}

/// The problem that an error of reading a body (or of parsing it as it comes) stands for: the reason is
/// somewhere in its chain of causes.
pub fn problem(error: &(dyn Error + 'static), limit: usize) -> Problem {
    let mut cause = Some(error);
    while let Some(error) = cause {
        if error.is::<LengthLimitError>() {
            return Problem::body_too_large(limit);
        }
        if error.is::<TimeoutError>() {
            return Problem::body_timeout();
        }
        if let Some(error) = error.downcast_ref::<axum::extract::multipart::MultipartError>()
            && error.status().is_client_error()
            && error.status() != axum::http::StatusCode::PAYLOAD_TOO_LARGE
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
