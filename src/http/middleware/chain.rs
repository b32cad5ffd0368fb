//! The middleware in the order in which requests meet it.
//!
//! The middleware of all requests is one layer of axum, and that of some routes another one. For each layer and request
//! axum clones and boxes all inner services: with a layer each, that takes a third of the network threads' time.

use super::answer_problems::answer_problems;
use super::authenticate::{authenticate, authenticate_metrics};
use super::client_quotas::{bound_rate, identify};
use super::host_and_origin::{check_origin, one_host};
use super::request_body::{drain_refused, pace_body};
use super::response_headers::{mark_draining, secure};
use super::telemetry::{count_request, log_request};
use crate::http::extract::instance::{REQUEST_ID, set_request_id};
use crate::http::state::AppState;
use axum::extract::{Request, State};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

/// What every request passes through.
pub async fn every_request(
    State(state): State<AppState>,
    mut request: Request,
    next: Next,
) -> Response {
    let state = &state;
    let id = set_request_id(request.headers_mut());
    // From the inside out: the last is the first to see the request.
    let handle = async |request| next.run(request).await;
    let handle = async |request| drain_refused(state, request, handle).await;
    let handle = async |request| handle(pace_body(&state.config, request)).await;
    let handle = async |request| match one_host(&request) {
        Ok(()) => handle(request).await,
        Err(problem) => problem.into_response(),
    };
    let handle = async |request| bound_rate(state, request, handle).await;
    let handle = async |request| answer_problems(state, request, handle).await;
    let handle = async |request| log_request(state, request, handle).await;
    let mut response = count_request(state, request, handle).await;
    mark_draining(state, &mut response);
    secure(&mut response);
    response.headers_mut().insert(REQUEST_ID, id);
    response
}

/// What requests for the page and the documents pass through besides.
pub async fn page_request(State(state): State<AppState>, request: Request, next: Next) -> Response {
    match check_origin(&state, &request) {
        Ok(()) => next.run(request).await,
        Err(problem) => problem.into_response(),
    }
}

/// What requests for sessions pass through besides.
pub async fn session_request(
    State(state): State<AppState>,
    mut request: Request,
    next: Next,
) -> Response {
    if let Err(problem) = check_origin(&state, &request) {
        return problem.into_response();
    }
    match authenticate(&state, &mut request).await {
        Ok(()) => identify(&state, request, async |request| next.run(request).await).await,
        Err(unauthorized) => unauthorized,
    }
}

/// What requests for the metrics pass through besides.
pub async fn metrics_request(
    State(state): State<AppState>,
    mut request: Request,
    next: Next,
) -> Response {
    match authenticate_metrics(&state, &mut request).await {
        Ok(()) => next.run(request).await,
        Err(unauthorized) => unauthorized,
    }
}
