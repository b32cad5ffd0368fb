//! How long a session lives without use.

use std::time::Duration;

/// How long a session lives without use.
#[derive(Debug, Clone, Copy)]
pub struct Lease {
    /// From its opening to its first frame.
    pub first: Duration,
    /// After each frame.
    pub idle: Duration,
}
