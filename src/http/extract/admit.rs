//! What a request with a body must pass before any of it is read.

use crate::http::problems::problem::Problem;
use crate::http::quotas::client::Client;
use crate::http::quotas::clients::RequestPermit;
use crate::http::state::AppState;
use axum::http::header::CONTENT_LENGTH;
use axum::http::request::Parts;

/// Takes a place among the client's requests in flight.
///
/// # Errors
/// The announced body is too large, the queue is full, or the client has too many requests in flight.
pub fn admit(state: &AppState, parts: &Parts) -> Result<RequestPermit, Problem> {
    let max = state.config.max_body_bytes;
    let length = parts.headers.get(CONTENT_LENGTH);
    let length = length.and_then(|length| length.to_str().ok()?.parse::<u64>().ok());
    if length.is_some_and(|length| length > max as u64) {
        return Err(Problem::body_too_large(max));
    }
    state.service.admission.check_place()?;
    state.clients.account(&Client::of(parts)).request()
}
