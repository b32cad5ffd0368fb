//! Marks the answers of a service that is about to end with `Draining: true`, so that clients take their sessions
//! elsewhere in time.

use crate::http::state::AppState;
use axum::extract::{Request, State};
use axum::http::{HeaderName, HeaderValue};
use axum::middleware::Next;
use axum::response::Response;

pub const DRAINING: HeaderName = HeaderName::from_static(bagtrack_api::headers::DRAINING);

pub async fn mark_draining(
    State(state): State<AppState>,
    request: Request,
    next: Next,
) -> Response {
    let mut response = next.run(request).await;
    if state.is_draining() {
        let marked = HeaderValue::from_static("true");
        response.headers_mut().insert(DRAINING, marked);
    }
    response
}
