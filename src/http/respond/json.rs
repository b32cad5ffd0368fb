//! Answers as JSON, which end with a newline: a shell's prompt then stands on a line of its own.

use super::charged_body::{ChargedBody, charged_body};
use crate::http::problems::problem::Problem;
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use bagtrack_sessions::Charge;
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

/// A value as JSON, whose memory is charged until the client has taken it.
///
/// # Errors
/// It cannot be written as JSON.
pub fn charged(value: &impl Serialize, charge: Charge) -> Result<ChargedBody, Problem> {
    let body = line(value).map_err(|error| Problem::internal(Arc::new(error)))?;
    Ok(charged_body("application/json", body, charge))
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
