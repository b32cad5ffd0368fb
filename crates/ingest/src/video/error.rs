//! Why a video has no further picture.

/// Why a video has no further picture.
#[derive(Debug, thiserror::Error)]
pub enum VideoError {
    /// The program cannot be started.
    #[error("`{program}` cannot be started: {source}")]
    NoProgram {
        /// Its name or path.
        program: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The video is damaged, of an unknown kind, or takes more than it may; the text says what the program found.
    #[error("the video cannot be decoded: {0}")]
    Damaged(String),
}
