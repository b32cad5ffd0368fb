//! Problem documents.

use reqwest::StatusCode;
use serde::Deserialize;
use std::time::Duration;

/// A problem document of the service (RFC 9457). A proxy's error page becomes one with the status alone.
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize, thiserror::Error)]
#[error("{} ({status})", if detail.is_empty() { title } else { detail })]
#[serde(default)]
#[non_exhaustive]
pub struct Problem {
    /// Names the kind of problem, and opens as a page at the service: `/docs/problems#…`. Empty where the answer was no problem document.
    #[serde(rename = "type")]
    pub type_uri: String,
    /// The kind of problem in a few words.
    pub title: String,
    /// The status code of the answer.
    pub status: u16,
    /// What happened this time, and what to do.
    pub detail: String,
    /// The path of the request.
    pub instance: String,
    /// The id of the request, for the service's log.
    pub request_id: String,
    /// Which frame of the request is meant, counted from 0.
    pub index: Option<usize>,
    /// With a wrong frame number: the number of the next frame.
    pub expected_frame: Option<u64>,
    /// After which time trying again makes sense.
    #[serde(skip)]
    pub retry_after: Option<Duration>,
}

impl Problem {
    /// The kind of problem: the last part of its type, such as `session-not-found`.
    pub fn kind(&self) -> &str {
        self.type_uri.rsplit(['#', ':']).next().unwrap_or_default()
    }

    /// From the answer to a request.
    pub(crate) fn read(status: StatusCode, retry_after: Option<Duration>, body: &[u8]) -> Self {
        let read = serde_json::from_slice(body);
        let problem = read.unwrap_or_else(|_| Self {
            title: status.canonical_reason().unwrap_or("an error").to_owned(),
            ..Self::default()
        });
        Self {
            status: status.as_u16(),
            retry_after,
            ..problem
        }
    }
}
