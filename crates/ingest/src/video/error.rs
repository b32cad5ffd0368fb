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
    /// The video is damaged, of an unknown kind, or takes more than it may.
    #[error("the video cannot be decoded from its picture {picture} on: {reason}")]
    Damaged {
        /// The first picture that cannot be had, counted from 1.
        picture: usize,
        /// What the program found.
        reason: String,
    },
}
