//! Problem documents for what ends before any handler sees it: heads that hyper cannot read, and connections over a
//! share.

use super::json;
use super::problems::document::{MEDIA_TYPE, ProblemDocument};
use super::problems::problem::Problem;
use uuid::Uuid;

/// The answer with its document in place of this one, if it is one of hyper's own to a head that it cannot read. Those
/// have no body, and none of the headers that all others have.
pub fn document_for(answer: &[u8]) -> Option<Vec<u8>> {
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
    let problem = match status.get(..3)? {
        "400" => Problem::malformed("The head of the request is not HTTP/1.1."),
        "414" => Problem::uri_too_long(),
        "431" => Problem::head_too_large(),
        _ => return None,
    };
    Some(answer_of(&problem))
}

/// The answer that ends a connection with this problem. Its path is not known.
pub fn answer_of(problem: &Problem) -> Vec<u8> {
    let id = Uuid::new_v4().to_string();
    let document = ProblemDocument::new(problem, "/".to_owned(), id.clone());
    let body = json::line(&document).unwrap_or_default();
    let retry = problem.retry_seconds();
    let retry = retry.map_or(String::new(), |seconds| {
        format!("retry-after: {seconds}\r\n")
    });
    let head = format!(
        "HTTP/1.1 {}\r\ncontent-type: {MEDIA_TYPE}\r\ncontent-length: {}\r\n{retry}x-request-id: {id}\r\n\
         cache-control: no-store\r\nx-content-type-options: nosniff\r\nconnection: close\r\n\r\n",
        problem.kind().status(),
        body.len()
    );
    [head.into_bytes(), body].concat()
}
