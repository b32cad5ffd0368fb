//! The tracker: section III of the paper, as a pure state machine. No async, no HTTP, no files, no clock.

mod frame;
mod params;

pub use frame::{FrameError, GrayFrame, Rect, WORKING_SIDE};
pub use params::{Params, ParamsError, Preset};

use serde::{Deserialize, Serialize};

/// Whether the tracker believes its own box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The box is on the target.
    Tracking,
    /// The box may be on the target.
    Uncertain,
    /// The target is out of sight; the box is the best guess.
    Lost,
}

/// The answer to one frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Which frame this answers; the first frame of a session is 0.
    pub frame: u64,
    /// Where the target is, in the pixels of the uploaded frame.
    pub target: Rect,
    /// The chance, in [0, 1], that the box overlaps the target by half or more.
    pub score: f32,
    /// What the score and its history mean.
    pub status: Status,
}

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
    /// The snapshot is damaged, or of another version.
    #[error("the snapshot {0}")]
    Snapshot(&'static str),
}

/// Follows one object.
#[derive(Debug, Clone)]
pub struct Tracker {}

impl Tracker {
    /// Starts on `frame` with the box `target`, in the pixels of the uploaded frame.
    pub fn new(_frame: &GrayFrame, _target: Rect, _params: Params) -> Result<Self, TrackerError> {
        todo!()
    }

    /// Finds the target in the next frame.
    pub fn step(&mut self, _frame: &GrayFrame) -> Result<Estimate, TrackerError> {
        todo!()
    }

    /// The user corrects the box: `frame` counts as the next frame, with the answer given.
    /// The bag keeps what it knew and gains the new look.
    pub fn retarget(
        &mut self,
        _frame: &GrayFrame,
        _target: Rect,
    ) -> Result<Estimate, TrackerError> {
        todo!()
    }

    /// The last answer.
    pub fn estimate(&self) -> Estimate {
        todo!()
    }

    /// The parameters of this tracker.
    pub fn params(&self) -> &Params {
        todo!()
    }

    /// Width and height of the session's frames, before downscaling.
    pub fn source_size(&self) -> (u32, u32) {
        todo!()
    }

    /// The whole state as bytes, versioned.
    pub fn snapshot(&self) -> Vec<u8> {
        todo!()
    }

    /// A tracker that goes on from `snapshot`, bit for bit.
    pub fn restore(_snapshot: &[u8]) -> Result<Self, TrackerError> {
        todo!()
    }
}
