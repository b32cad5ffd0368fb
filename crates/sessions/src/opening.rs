//! How a session was opened: what a request that opens it again is compared with, and its answer.

use super::targets::Estimates;
use serde::{Deserialize, Serialize};

/// How a session was opened.
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
