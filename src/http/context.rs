//! What surrounds every request: its id, its span in the log, and its problem document.
//!
//! The id comes from the client's `x-request-id` where that is sane (so that a trace can be followed through
//! several services), else it is made here. The log has the method, path and status; never bytes or boxes.

use super::problem::Problem;
use axum::body::Body;
use axum::extract::Request;
use axum::http::header::{CACHE_CONTROL, CONTENT_LENGTH, HeaderName, X_CONTENT_TYPE_OPTIONS};
use axum::http::{HeaderMap, HeaderValue};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::any::Any;
use std::time::Instant;
use tracing::Instrument;
use uuid::Uuid;

/// The header of request ids.
pub const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");
const MAX_ID_LENGTH: usize = 64;

/// The middleware, outermost.
pub async fn request_context(request: Request, next: Next) -> Response {
    let started = Instant::now();
    let id = request_id(request.headers());
    let path = request.uri().path().to_owned();
    let span = tracing::info_span!("request", id, method = %request.method(), path);
    let mut response = next.run(request).instrument(span.clone()).await;
    let _entered = span.enter();
    if let Some(problem) = response.extensions_mut().remove::<Problem>() {
        log_problem(&problem);
        let mut written = problem.respond(path, id.clone());
        // The first response's headers stay: they may hold more than the problem knows, like `Allow`.
        for (name, value) in response.headers() {
            written.headers_mut().entry(name).or_insert(value.clone());
        }
        written.headers_mut().remove(CONTENT_LENGTH);
        response = written;
    }
    let headers = response.headers_mut();
    let value = HeaderValue::from_str(&id).expect("ids are visible ASCII");
    headers.insert(REQUEST_ID, value);
    headers.insert(X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    let no_store = HeaderValue::from_static("no-store");
    headers.entry(CACHE_CONTROL).or_insert(no_store);
    let (status, elapsed) = (response.status().as_u16(), started.elapsed());
    tracing::info!(status, ms = elapsed.as_secs_f64() * 1e3, "answered");
    response
}

/// The answer to a handler's panic; the panic itself has been printed by the panic hook.
pub fn panic_response(_panic: Box<dyn Any + Send + 'static>) -> Response<Body> {
    Problem::panicked().into_response()
}

fn log_problem(problem: &Problem) {
    let (kind, cause) = (problem.kind().slug(), problem.cause());
    let cause = cause.as_deref().unwrap_or("none");
    if problem.kind().status().as_u16() == 500 {
        tracing::error!(kind, cause, "problem");
    } else {
        tracing::info!(kind, cause, "problem");
    }
}

fn request_id(headers: &HeaderMap) -> String {
    let sent = headers.get(REQUEST_ID).and_then(|id| id.to_str().ok());
    let is_sane = |id: &&str| {
        let allowed = |c: u8| c.is_ascii_alphanumeric() || b"-_.:".contains(&c);
        (1..=MAX_ID_LENGTH).contains(&id.len()) && id.bytes().all(allowed)
    };
    match sent.filter(is_sane) {
        Some(id) => id.to_owned(),
        None => Uuid::new_v4().to_string(),
    }
}
