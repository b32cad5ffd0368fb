//! Bodies of answers. Some hold the charge for their memory until the client has taken them.
//!
//! JSON ends with a newline: a shell's prompt then stands on a line of its own.

use crate::http::problems::problem::Problem;
use axum::body::Bytes;
use axum::http::header::CONTENT_TYPE;
use axum::http::{HeaderName, StatusCode};
use axum::response::{IntoResponse, Response};
use bagtrack_sessions::{Charge, ChargedBytes};
use serde::Serialize;
use std::sync::Arc;

/// A body with its media type.
pub type ChargedBody = ([(HeaderName, &'static str); 1], Bytes);

pub fn charged_body(
    media_type: &'static str,
    bytes: impl AsRef<[u8]> + Send + 'static,
    charge: Charge,
) -> ChargedBody {
    let body = Bytes::from(ChargedBytes::new(bytes, charge));
    ([(CONTENT_TYPE, media_type)], body)
}

/// A JSON answer.
#[derive(Debug, Clone, Copy)]
pub struct Json<T>(pub T);

impl<T: Serialize> IntoResponse for Json<T> {
    fn into_response(self) -> Response {
        match json_line(&self.0) {
            Ok(body) => ([(CONTENT_TYPE, "application/json")], body).into_response(),
            Err(error) => {
                tracing::error!(%error, "an answer cannot be written as JSON");
                StatusCode::INTERNAL_SERVER_ERROR.into_response()
            }
        }
    }
}

/// A value as JSON, whose memory is charged until the client has taken it.
///
/// # Errors
/// The value cannot be written as JSON.
pub fn charged_json(value: &impl Serialize, charge: Charge) -> Result<ChargedBody, Problem> {
    let body = json_line(value).map_err(|error| Problem::internal(Arc::new(error)))?;
    Ok(charged_body("application/json", body, charge))
}

/// A value as one line of JSON.
///
/// # Errors
/// The value cannot be written as JSON.
pub fn json_line(value: &impl Serialize) -> serde_json::Result<Vec<u8>> {
    let mut line = serde_json::to_vec(value)?;
    line.push(b'\n');
    Ok(line)
}
