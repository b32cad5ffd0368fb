//! What can go wrong.

use bagtrack_api::ProblemDocument as Problem;
use std::error::Error;

/// Why a call failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ClientError {
    /// The service refused the request; the session is as it was. Frames without an answer are forgotten.
    #[error("the service refuses: {0}")]
    Refused(#[source] Box<Problem>),
    /// For as long as is tried the service said to come again later. The frame is kept: the next call sends it.
    #[error("the service is not available: {0}")]
    Unavailable(#[source] Box<Problem>),
    /// For as long as is tried no whole answer came, and the frame is kept; or the request cannot be made at all.
    #[error("no answer: {}", reason(.0))]
    Transport(#[from] reqwest::Error),
    /// The service needs this frame again, which is not kept any more.
    #[error("the service needs frame {frame} again, which is not kept any more")]
    NotKept {
        /// The number of the frame.
        frame: u64,
    },
    /// The answer is none of a bagtrack service.
    #[error("the answer cannot be read: {0}")]
    Answer(#[from] serde_json::Error),
    /// An API key is empty, or has characters that a header cannot have.
    #[error("the API key is empty, or has characters that a header cannot have")]
    InvalidKey,
}

/// What an error stands on, the deepest last.
pub fn causes(error: &reqwest::Error) -> Vec<String> {
    let mut causes = Vec::new();
    let mut next = error.source();
    while let Some(cause) = next {
        causes.push(cause.to_string());
        next = cause.source();
    }
    causes
}

/// The last cause and the address, where reqwest tells the address with its long query alone.
fn reason(error: &reqwest::Error) -> String {
    let mut reason = causes(error).pop().unwrap_or_else(|| error.to_string());
    if let Some(mut url) = error.url().cloned() {
        url.set_query(None);
        // These are not for a log. What has no host has none of them.
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
