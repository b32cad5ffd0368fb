//! Answers as JSON, which end with a newline: a shell's prompt then stands on a line of its own.

use crate::http::problems::problem::Problem;
use axum::body::Bytes;
use axum::http::header::CONTENT_TYPE;
use axum::http::{HeaderName, StatusCode};
use axum::response::{IntoResponse, Response};
use bagtrack_sessions::{Charge, ChargedBytes};
use serde::Serialize;
use std::sync::Arc;

/// A JSON answer.
#[derive(Debug, Clone, Copy)]
pub struct Json<T>(pub T);

impl<T: Serialize> IntoResponse for Json<T> {
    fn into_response(self) -> Response {
        match line(&self.0) {
            Ok(body) => ([(CONTENT_TYPE, "application/json")], body).into_response(),
            Err(error) => {
                tracing::error!(%error, "an answer cannot be written as JSON");
                StatusCode::INTERNAL_SERVER_ERROR.into_response()
            }
        }
    }
}

/// JSON that is written already.
pub type JsonBytes = ([(HeaderName, &'static str); 1], Bytes);

/// A value as JSON, whose memory is charged until the client has taken it.
///
/// # Errors
/// It cannot be written as JSON.
pub fn charged(value: &impl Serialize, charge: Charge) -> Result<JsonBytes, Problem> {
    let body = line(value).map_err(|error| Problem::internal(Arc::new(error)))?;
    let body = Bytes::from(ChargedBytes::new(body, charge));
    Ok(([(CONTENT_TYPE, "application/json")], body))
}

/// A value as one line of JSON.
///
/// # Errors
/// It cannot be written as JSON.
pub fn line(value: &impl Serialize) -> serde_json::Result<Vec<u8>> {
    let mut line = serde_json::to_vec(value)?;
    line.push(b'\n');
    Ok(line)
}
