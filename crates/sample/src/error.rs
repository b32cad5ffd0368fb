//! Why a clip is refused.

use std::path::PathBuf;

/// Why a clip cannot be drawn or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// The number of frames, a side of the frame or an attribute is out of its range.
    #[error("{name} is {value}; it must be {expected}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// The value given.
        value: String,
        /// The range it must be in.
        expected: String,
    },
    /// The folder or a file in it cannot be written.
    #[error("{}: {reason}", path.display())]
    Write {
        /// What was being written.
        path: PathBuf,
        /// What went wrong.
        reason: String,
    },
}
