//! What the tracker refuses.

use crate::params::table::ParamsError;

/// Why a tracker could not be made, or a frame could not be taken. The state is unchanged.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackerError {
    /// A parameter is out of its range.
    #[error(transparent)]
    Params(#[from] ParamsError),
    /// The box is not finite, is too small, or does not touch the frame.
    #[error("the box {0}")]
    Target(&'static str),
    /// The frame's size differs from the size of the session's first frame.
    #[error("the frame is {got_width} x {got_height}, the session's frames are {width} x {height}")]
    FrameSize {
        /// Width of the session's frames, before downscaling.
        width: u32,
        /// Height of the session's frames, before downscaling.
        height: u32,
        /// Width of the frame that came.
        got_width: u32,
        /// Height of the frame that came.
        got_height: u32,
    },
    /// The frame was reduced to less than the size in which the session works.
    #[error("the frame was reduced to less than the session's working size")]
    Reduced,
    /// A second opinion is not possible with these parameters, or the session began with an expert that is not given.
    #[error("{0}")]
    Expert(&'static str),
    /// The snapshot is damaged, or of another version.
    #[error("the snapshot {0}")]
    Snapshot(&'static str),
}
