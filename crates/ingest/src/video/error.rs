//! Why a video has no further picture.

/// Most bytes of a decoder's address space, which holds some ten pictures. Pictures of 4096 x 2304 pixels fit, and some
/// of 8K.
pub const MAX_MEMORY: u64 = 768 << 20;
/// Most processor time in seconds.
pub(super) const MAX_CPU: u64 = 300;

/// Why a video has no further picture.
#[derive(Debug, thiserror::Error)]
pub enum VideoError {
    /// The program cannot be started.
    #[error("`{program}` cannot be started: {source}")]
    NoProgram {
        /// The program's name or path.
        program: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file has no stream of pictures.
    #[error("the file has no pictures, but sound or other data")]
    NoPictures,
    /// The codec is none of those that are read.
    #[error("the video's codec is not read here")]
    UnreadCodec,
    /// Decoding takes more of a resource than it may.
    #[error("decoding the video takes more than {0}")]
    TooCostly(Cost),
    /// The video is damaged, or of an unknown kind.
    #[error("the video cannot be decoded from its picture {picture} on: {reason}")]
    Damaged {
        /// The first picture that cannot be had, counted from 1.
        picture: usize,
        /// What the program found.
        reason: String,
    },
}

/// A resource that decoding may take only so much of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Cost {
    /// The address space of its process.
    #[error("{} MiB of memory", MAX_MEMORY >> 20)]
    Memory,
    /// Processor time, or memory: the system ends the process for either in the same way.
    #[error("{MAX_CPU} s of processor time, or than the memory that the machine has left")]
    Time,
    /// Pixels of a picture.
    #[error("{0} pixels in a picture")]
    Pixels(u64),
}
