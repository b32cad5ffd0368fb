//! What is written of one target in one frame, whatever the format.

use bagtrack_tracker::{Estimate, Status};

/// What is written of one target in one frame.
#[derive(Debug)]
pub struct Row {
    /// The frame's number in its video or folder, from 0.
    pub frame: u64,
    /// Seconds since the first frame of the video; frames of a folder have no time.
    pub time: Option<f64>,
    /// The name of the frame's file; frames of a video have none.
    pub file: Option<String>,
    /// The number of the target, from 0, in the order of the boxes.
    pub target: usize,
    /// Where it is, in 0-based pixels.
    pub estimate: Estimate,
}

impl Row {
    /// The status as the service calls it.
    pub fn status(&self) -> &'static str {
        match self.estimate.status {
            Status::Tracking => "tracking",
            Status::Uncertain => "uncertain",
            Status::Lost => "lost",
        }
    }
}

/// Which columns a table for people has.
#[derive(Debug, Clone, Copy)]
pub struct Columns {
    /// Whether the frames have times.
    pub time: bool,
    /// Whether there are several targets.
    pub target: bool,
}
