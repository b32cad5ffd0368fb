//! Counts requests and their bytes.

use crate::http::state::AppState;
use axum::body::{Body, HttpBody};
use axum::extract::{MatchedPath, Request};
use axum::http::Method;
use axum::response::Response;
use bagtrack_sessions::clock;
use http_body_util::BodyExt;

/// The middleware. It has to see the matched route.
pub async fn count_request(
    state: &AppState,
    request: Request,
    next: impl AsyncFnOnce(Request) -> Response,
) -> Response {
    let started = clock::now();
    let method = method_label(request.method());
    let route = request.extensions().get::<MatchedPath>().cloned();
    let received = state.metrics.received_bytes.clone();
    let request = request.map(|body| match body.is_end_stream() {
        true => body,
        false => Body::new(body.inspect_frame(move |frame| {
            let bytes = frame.data_ref().map_or(0, |data| data.len());
            received.increment(bytes as u64);
        })),
    });
    let response = next(request).await;
    let sent = state.metrics.sent_bytes.clone();
    let response = match response.body().size_hint().exact() {
        Some(bytes) => {
            sent.increment(bytes);
            response
        }
        // Lines count as they are sent.
        None => response.map(|body| {
            Body::new(body.inspect_frame(move |frame| {
                let bytes = frame.data_ref().map_or(0, |data| data.len());
                sent.increment(bytes as u64);
            }))
        }),
    };
    let route = route.as_ref().map_or("none", MatchedPath::as_str);
    let (status, seconds) = (response.status().as_u16(), started.elapsed().as_secs_f64());
    state.metrics.answered(method, route, status, seconds);
    response
}

/// Clients may send any word as the method.
pub(super) fn method_label(method: &Method) -> &'static str {
    match *method {
        Method::GET => "GET",
        Method::HEAD => "HEAD",
        Method::POST => "POST",
        Method::PUT => "PUT",
        Method::DELETE => "DELETE",
        Method::OPTIONS => "OPTIONS",
        _ => "other",
    }
}
