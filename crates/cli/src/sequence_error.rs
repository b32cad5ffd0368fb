//! Why a sequence is refused.

use std::path::{Path, PathBuf};

/// A sequence cannot be used; the text is one line and names the folder.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {reason}", dir.display())]
pub struct SequenceError {
    dir: PathBuf,
    reason: String,
}

impl SequenceError {
    /// A reason for the folder `dir`.
    pub fn new(dir: &Path, reason: impl Into<String>) -> Self {
        Self {
            dir: dir.to_owned(),
            reason: reason.into(),
        }
    }
}
