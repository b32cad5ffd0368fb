//! The errors of the client.

use bagtrack_api::ProblemDocument as Problem;
use std::error::Error;

/// Why a call failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ClientError {
    /// The service refused the request, and the session is unchanged. The client drops the frames without an answer.
    #[error("the service refuses: {0}")]
    Refused(#[source] Box<Problem>),
    /// During the whole time for retries, the service asked to try again later. The client keeps the frame, and the
    /// next call sends it.
    #[error("the service is not available: {0}")]
    Unavailable(#[source] Box<Problem>),
    /// During the whole time for retries, no complete answer came: the client keeps the frame, and the next call sends
    /// it. Or the request cannot be made at all.
    #[error("no answer: {}", reason(.0))]
    Transport(#[from] reqwest::Error),
    /// The service needs a frame again that the client does not keep any more.
    #[error("the service needs frame {frame} again, which is not kept any more")]
    NotKept {
        /// The number of the frame.
        frame: u64,
    },
    /// The answer is not that of a bagtrack service.
    #[error("the answer cannot be read: {0}")]
    Answer(#[from] serde_json::Error),
    /// An API key is empty, or has characters that a header cannot have.
    #[error("the API key is empty, or has characters that a header cannot have")]
    InvalidKey,
}

/// The messages of the errors that caused this one, the innermost last.
pub fn causes(error: &reqwest::Error) -> Vec<String> {
    let mut causes = Vec::new();
    let mut next = error.source();
    while let Some(cause) = next {
        causes.push(cause.to_string());
        next = cause.source();
    }
    causes
}

/// The innermost cause and the address without its query, instead of reqwest's text, which has only the long address.
fn reason(error: &reqwest::Error) -> String {
    let mut reason = causes(error).pop().unwrap_or_else(|| error.to_string());
    if let Some(mut url) = error.url().cloned() {
        url.set_query(None);
        // No user name or password in logs. The calls fail only for an address without a host, which has neither.
        let _ = (url.set_username(""), url.set_password(None));
        reason += &format!(" ({url})");
    }
    reason
}

impl From<Box<Problem>> for ClientError {
    fn from(problem: Box<Problem>) -> Self {
        Self::Refused(problem)
    }
}
