//! The answer to a connection over its address's share where none is left for probes either: it is written before any
//! request is read.

use crate::http::metrics::registry::Metrics;
use crate::http::middleware::security_headers::{HEADERS, STRICT};
use crate::http::problems::problem::Problem;
use crate::http::respond::json;
use axum::http::header::CONTENT_SECURITY_POLICY;
use bagtrack_api::media_types::PROBLEM;
use bagtrack_sessions::random::new_id;
use std::net::IpAddr;

/// The answer that ends a connection of this client with a problem. Counts it, and writes its line in the log.
pub fn answer_of(problem: &Problem, client: IpAddr, metrics: &Metrics) -> Vec<u8> {
    let id = new_id().to_string();
    metrics.problem(problem.kind());
    let (kind, status) = (problem.kind().slug(), problem.kind().status());
    tracing::info!(id, %client, kind, status, "connection refused");
    let document = problem.document("", "/".to_owned(), id.clone());
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
        "HTTP/1.1 {}\r\ncontent-type: {PROBLEM}\r\ncontent-length: {}\r\n{retry}x-request-id: {id}\r\n\
         cache-control: no-store\r\n{security}connection: close\r\n\r\n",
        problem.status(),
        body.len()
    );
    [head.into_bytes(), body].concat()
}
