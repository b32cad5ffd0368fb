//! Marks the answers of a service that is about to end with `Draining: true`, so that clients take their sessions
//! elsewhere in time.

use crate::http::state::AppState;
use axum::http::{HeaderName, HeaderValue};
use axum::response::Response;

pub const DRAINING: HeaderName = HeaderName::from_static(bagtrack_api::headers::DRAINING);

pub fn mark_draining(state: &AppState, response: &mut Response) {
    if state.is_draining() {
        let marked = HeaderValue::from_static("true");
        response.headers_mut().insert(DRAINING, marked);
    }
}
