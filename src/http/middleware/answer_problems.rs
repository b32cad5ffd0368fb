//! Writes the document of a problem that a handler or a middleware answered with, and counts it. The problem stays with
//! the response, for the line of the request in the log.

use crate::http::extract::instance::Instance;
use crate::http::problems::problem::Problem;
use crate::http::respond::body::Json;
use crate::http::state::AppState;
use axum::body::Body;
use axum::extract::Request;
use axum::http::HeaderValue;
use axum::http::header::{CONTENT_LENGTH, CONTENT_TYPE, RETRY_AFTER};
use axum::response::{IntoResponse, Response};
use bagtrack_api::media_types::PROBLEM;
use std::any::Any;

pub async fn answer_problems(
    state: &AppState,
    request: Request,
    next: impl AsyncFnOnce(Request) -> Response,
) -> Response {
    let instance = Instance::of(&request);
    let mut response = next(request).await;
    let Some(problem) = response.extensions().get::<Problem>() else {
        return response;
    };
    let document = Json(instance.count(state, problem)).into_response();
    let retry_after = problem.retry_seconds();
    *response.body_mut() = document.into_body();
    // The response's own headers stay: it may have some that the problem does not know, like `Connection`.
    let headers = response.headers_mut();
    headers.remove(CONTENT_LENGTH);
    headers.insert(CONTENT_TYPE, HeaderValue::from_static(PROBLEM));
    if let Some(seconds) = retry_after {
        headers.insert(RETRY_AFTER, HeaderValue::from(seconds));
    }
    response
}

/// The answer to a panic in a handler. The panic hook has already reported the panic itself.
pub fn panic_response(_panic: Box<dyn Any + Send + 'static>) -> Response<Body> {
    Problem::panicked().into_response()
}
