//! Writes the document of a problem that a handler or a layer answered with, and its line in the log.

use super::base_path::client_path;
use super::request_id;
use crate::http::problems::document::respond;
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::StatusCode;
use axum::http::header::CONTENT_LENGTH;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::any::Any;

/// The middleware.
pub async fn answer_problems(
    State(state): State<AppState>,
    request: Request,
    next: Next,
) -> Response {
    let (path, id) = (client_path(&request), request_id::of(&request));
    let mut response = next.run(request).await;
    let Some(problem) = response.extensions_mut().remove::<Problem>() else {
        return response;
    };
    state.metrics.problem(problem.kind());
    log_problem(&problem);
    let mut written = respond(&problem, state.config.base_path.as_str(), path, id);
    // The first response's headers stay: it may have some that the problem does not know, like `Allow`.
    for (name, value) in response.headers() {
        written.headers_mut().entry(name).or_insert(value.clone());
    }
    written.headers_mut().remove(CONTENT_LENGTH);
    written
}

/// The answer to a panic in a handler. The panic hook has already reported the panic itself.
pub fn panic_response(_panic: Box<dyn Any + Send + 'static>) -> Response<Body> {
    Problem::panicked().into_response()
}

fn log_problem(problem: &Problem) {
    let (kind, cause) = (problem.kind().slug(), problem.cause());
    let cause = cause.as_deref().unwrap_or("none");
    if problem.kind().status() == StatusCode::INTERNAL_SERVER_ERROR {
        tracing::error!(kind, cause, "problem");
    } else {
        tracing::info!(kind, cause, "problem");
    }
}
