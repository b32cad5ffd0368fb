//! The problem document as it is sent.

use super::problem::Problem;
use serde::Serialize;

/// The media type of problem documents.
pub const MEDIA_TYPE: &str = "application/problem+json";

/// A problem document (RFC 9457).
#[derive(Debug, Serialize, utoipa::ToSchema)]
#[schema(as = Problem)]
pub struct ProblemDocument {
    /// Names the kind of problem, and opens as a page with its causes and cure. Relative to the service; what follows `#`
    /// never changes.
    #[schema(format = "uri-reference", example = "/docs/problems#session-not-found")]
    r#type: String,
    /// The kind of problem in a few words.
    title: &'static str,
    /// The status code of the response.
    #[schema(minimum = 400, maximum = 599)]
    status: u16,
    /// What happened this time, and what to do.
    detail: String,
    /// The path of the request.
    #[schema(example = "/sessions")]
    instance: String,
    /// The id of the request; also in the header `x-request-id`.
    #[schema(example = "1da43888-6f49-40f8-a05c-7bb628ba4f6a")]
    request_id: String,
    /// With a wrong frame number: the number of the next frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    expected_frame: Option<u64>,
    /// Which frame of the request is meant, counted from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<u32>, nullable = false)]
    index: Option<usize>,
}

impl ProblemDocument {
    /// The document of a problem, for the request to this path with this id, of a service below a base path.
    pub fn new(problem: &Problem, base_path: &str, instance: String, request_id: String) -> Self {
        let kind = problem.kind();
        Self {
            r#type: kind.uri(base_path),
            title: kind.title(),
            status: kind.status().as_u16(),
            detail: problem.detail().to_owned(),
            instance,
            request_id,
            expected_frame: problem.expected_frame(),
            index: problem.index(),
        }
    }
}
