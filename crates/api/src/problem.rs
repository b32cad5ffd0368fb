//! The problem document.

use serde::{Deserialize, Serialize};
use std::time::Duration;

/// A problem document (RFC 9457).
// Most members have defaults: of a proxy's error page, a client makes a document with the status alone.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, thiserror::Error)]
#[error("{} ({status})", if detail.is_empty() { title } else { detail })]
#[cfg_attr(feature = "service", derive(utoipa::ToSchema), schema(as = Problem))]
pub struct ProblemDocument {
    /// Names the kind of problem, and opens as a page with its causes and cure. Relative to the service; what follows
    /// `#` never changes.
    #[serde(default, rename = "type")]
    #[cfg_attr(
        feature = "service",
        schema(
            format = "uri-reference",
            example = "/docs/problems#session-not-found",
            required
        )
    )]
    pub type_uri: String,
    /// The kind of problem in a few words.
    #[serde(default)]
    #[cfg_attr(feature = "service", schema(required))]
    pub title: String,
    /// The status code of the response.
    #[serde(default)]
    #[cfg_attr(feature = "service", schema(minimum = 400, maximum = 599, required))]
    pub status: u16,
    /// What happened this time, and what to do.
    #[serde(default)]
    #[cfg_attr(feature = "service", schema(required))]
    pub detail: String,
    /// The path of the request.
    #[serde(default)]
    #[cfg_attr(feature = "service", schema(example = "/sessions", required))]
    pub instance: String,
    /// The id of the request; also in the header `x-request-id`.
    #[serde(default)]
    #[cfg_attr(
        feature = "service",
        schema(example = "1da43888-6f49-40f8-a05c-7bb628ba4f6a", required)
    )]
    pub request_id: String,
    /// With a wrong frame number: the number of the next frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "service", schema(nullable = false))]
    pub expected_frame: Option<u64>,
    /// Which frame of the request is meant, counted from 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "service", schema(value_type = Option<u32>, nullable = false))]
    pub index: Option<usize>,
    /// After which time trying again makes sense. Not in the document: the header `Retry-After` has it.
    #[serde(skip)]
    pub retry_after: Option<Duration>,
}

impl ProblemDocument {
    /// The name of the kind of problem: the last part of its type, such as `session-not-found`.
    pub fn kind(&self) -> &str {
        self.type_uri.rsplit(['#', ':']).next().unwrap_or_default()
    }
}
