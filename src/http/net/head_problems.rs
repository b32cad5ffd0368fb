//! Problem documents for what ends before any handler sees it: heads that hyper cannot read, and connections over a
//! share.

use crate::http::metrics::registry::Metrics;
use crate::http::middleware::security_headers::{HEADERS, STRICT};
use crate::http::problems::document::{MEDIA_TYPE, ProblemDocument};
use crate::http::problems::problem::Problem;
use crate::http::respond::json;
use axum::http::header::CONTENT_SECURITY_POLICY;
use std::net::IpAddr;
use uuid::Uuid;

/// The problem that this answer is, if it is one of hyper's own to a head that it cannot read. Those have no body, and
/// none of the headers that all others have.
pub fn problem_of(answer: &[u8]) -> Option<Problem> {
    let head = std::str::from_utf8(answer).ok()?.strip_suffix("\r\n\r\n")?;
    let (status, headers) = head.strip_prefix("HTTP/1.1 ")?.split_once("\r\n")?;
    let has = |line: &str| {
        headers
            .lines()
            .any(|other| other.eq_ignore_ascii_case(line))
    };
    if !has("content-length: 0") || headers.to_ascii_lowercase().contains("x-request-id") {
        return None;
    }
    match status.get(..3)? {
        "400" => Some(Problem::malformed(
            "The head of the request is not HTTP/1.1.",
        )),
        "414" => Some(Problem::uri_too_long()),
        "431" => Some(Problem::head_too_large()),
        _ => None,
    }
}

/// The answer that ends the connection of this client with a problem; counts it, and writes its line in the log. Its
/// path is not known.
pub fn answer_of(problem: &Problem, client: IpAddr, metrics: &Metrics) -> Vec<u8> {
    let id = Uuid::new_v4().to_string();
    metrics.problem(problem.kind());
    let (kind, status) = (problem.kind().slug(), problem.kind().status().as_u16());
    tracing::info!(id, %client, kind, status, "connection refused");
    let document = ProblemDocument::new(problem, "/".to_owned(), id.clone());
    let body = json::line(&document).unwrap_or_default();
    let retry = problem.retry_seconds();
    let retry = retry.map_or(String::new(), |seconds| {
        format!("retry-after: {seconds}\r\n")
    });
    let security = [(CONTENT_SECURITY_POLICY, STRICT)]
        .into_iter()
        .chain(HEADERS);
    let security: String = security
        .map(|(name, value)| format!("{name}: {value}\r\n"))
        .collect();
    let head = format!(
        "HTTP/1.1 {}\r\ncontent-type: {MEDIA_TYPE}\r\ncontent-length: {}\r\n{retry}x-request-id: {id}\r\n\
         cache-control: no-store\r\n{security}connection: close\r\n\r\n",
        problem.kind().status(),
        body.len()
    );
    [head.into_bytes(), body].concat()
}
