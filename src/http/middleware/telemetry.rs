//! What is recorded of each request: its metrics, and one line in the log, with the problem that it was answered with;
//! a span around what is logged on its behalf, and the trace that it belongs to.
//!
//! The span has the ids of the request and of its trace, the client's address, the name of its API key (never the key),
//! the method (`other` where no call has it), and the path: never bytes or boxes, at most 200 bytes of the path, and of
//! a session's id only its beginning. Probes come every few seconds: without the level `debug` they have no span, and
//! only a refused probe has a line, which names it.

use super::client_quotas::note_address;
#[cfg(feature = "otel")]
use super::trace_context::exported;
use super::trace_context::{TRACEPARENT, TraceContext};
use crate::http::extract::instance::Instance;
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::body::{Body, HttpBody};
use axum::extract::{MatchedPath, Request};
use axum::http::Method;
use axum::response::Response;
use bagtrack_api::ProblemKind as Kind;
use bagtrack_sessions::{clock, short_id};
use http_body_util::BodyExt;
use percent_encoding::percent_decode_str;
use std::net::IpAddr;
use tracing::field::Empty;
use tracing::{Instrument, Level, Span};
use uuid::Uuid;

const MAX_LOGGED_PATH: usize = 200;
/// Characters of a session's id that are logged.
const SHOWN_OF_ID: usize = 8;
const PROBES: [&str; 3] = ["/healthz", "/readyz", "/metrics"];

/// Writes the line of a request in the log, in a span of its own.
pub async fn log_request(
    state: &AppState,
    mut request: Request,
    next: impl AsyncFnOnce(Request) -> Response,
) -> Response {
    let started = clock::now();
    let probe = PROBES
        .into_iter()
        .find(|path| *path == request.uri().path());
    let address = note_address(state, &mut request);
    let (span, context) = (
        span(&request, probe.is_some(), address),
        TraceContext::of(request.headers()),
    );
    #[cfg(feature = "otel")]
    let context = exported::join(&span, &request, context);
    span.record("trace", context.trace_id());
    let mut response = next(request).instrument(span.clone()).await;
    response.headers_mut().insert(TRACEPARENT, context.header());
    let (status, ms) = (
        response.status().as_u16(),
        (started.elapsed().as_secs_f64() * 1e6).round() / 1e3,
    );
    #[cfg(feature = "otel")]
    exported::answered(&span, status);
    let problem = response.extensions_mut().remove::<Problem>();
    let kind = problem.as_ref().map(Problem::kind);
    let cause = problem.as_ref().and_then(Problem::cause);
    let (problem, cause) = (kind.map(Kind::slug), cause.as_deref());
    span.in_scope(|| match kind {
        Some(Kind::Internal) => tracing::error!(status, ms, probe, problem, cause, "answered"),
        None if probe.is_some() => tracing::debug!(status, ms, "answered"),
        _ => tracing::info!(status, ms, probe, problem, cause, "answered"),
    });
    response
}

fn span(request: &Request, is_probe: bool, client: IpAddr) -> Span {
    let id = Instance::of(request).request_id;
    let (method, path) = (method_label(request.method()), logged(request.uri().path()));
    match is_probe {
        true => {
            tracing::span!(Level::DEBUG, "request", id, trace = Empty, %client, key = Empty, %method, path)
        }
        false => {
            tracing::span!(Level::INFO, "request", id, trace = Empty, %client, key = Empty, %method, path)
        }
    }
}

fn logged(path: &str) -> String {
    let path = &path[..path.floor_char_boundary(MAX_LOGGED_PATH)];
    let mut before = "";
    let shown = path.split('/').map(|segment| {
        let follows = std::mem::replace(&mut before, segment) == "sessions";
        let text = percent_decode_str(segment).decode_utf8_lossy();
        match text.parse::<Uuid>() {
            Ok(id) => short_id(id),
            // The segment may be an id with more behind it.
            Err(_) if follows => shortened(&text),
            Err(_) => segment.to_owned(),
        }
    });
    shown.collect::<Vec<String>>().join("/")
}

/// The beginning of a text that may be an id.
fn shortened(text: &str) -> String {
    match text.char_indices().nth(SHOWN_OF_ID) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

/// Counts requests and their bytes. Runs after routing, since the route is a label.
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
        // A body of unknown length, such as lines of JSON, counts as it is sent.
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

/// The method as a label. Clients may send any word as the method, and labels have to be few.
fn method_label(method: &Method) -> &'static str {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_shortened_however_they_are_written() {
        for id in [
            "67e55044-10b1-426f-9247-bb680e5fe0c8",
            "67E5504410B1426F9247BB680E5FE0C8",
            "%367e55044-10b1-426f-9247-bb680e5fe0c8",
            "67e55044-10b1-426f-9247-bb680e5fe0c8;x=1",
        ] {
            let path = format!("/sessions/{id}/frames");
            assert_eq!(logged(&path), "/sessions/67e55044…/frames");
        }
        assert_eq!(logged("/sessions/short/frames"), "/sessions/short/frames");
        assert_eq!(logged("/healthz"), "/healthz");
        // Byte 200 is in the middle of a character.
        let long = format!("/{}", "é".repeat(30_000));
        assert_eq!(logged(&long).len(), 199);
    }
}
