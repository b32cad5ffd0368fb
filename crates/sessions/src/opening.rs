//! What never changes of a session: whose it is, and how it was opened.

use super::targets::Estimates;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The client that a session belongs to: the name of its API key, or nobody where the service knows no keys. Others do
/// not see the session.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct Owner(Option<Arc<str>>);

impl Owner {
    /// The client whose API key has this name.
    pub fn named(name: &str) -> Self {
        Self(Some(name.into()))
    }

    /// The name of the API key.
    pub fn name(&self) -> Option<&str> {
        self.0.as_deref()
    }
}

/// How a session was opened: what a request that opens it again is compared with, and its answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Opening {
    /// Digest of the request's frame and settings.
    pub request: [u8; 32],
    /// The answer: that of frame 0, or of the snapshot's frame.
    pub estimates: Estimates,
    /// When the session was to expire, in seconds since 1970.
    pub expires: u64,
    /// A random number, which tells apart sessions that had one id after the other.
    pub incarnation: u64,
}
