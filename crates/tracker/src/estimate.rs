//! The answer to one frame.

use serde::{Deserialize, Serialize};

use crate::image::rect::Rect;

/// Below this score the target counts as uncertain.
pub(crate) const UNCERTAIN_BELOW: f32 = 0.5;

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

impl Status {
    /// The status of an answer with this `score` that an expert had a part in; `lost` when the filter had lost the
    /// target.
    pub(crate) fn of_both(score: f32, lost: bool) -> Self {
        match (score >= UNCERTAIN_BELOW, lost) {
            (true, _) => Self::Tracking,
            (false, false) => Self::Uncertain,
            (false, true) => Self::Lost,
        }
    }
}

/// The answer to one frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Which frame this answers; the first frame of a session is 0.
    pub frame: u64,
    /// Where the target is, in the pixels of the uploaded frame.
    pub target: Rect,
    /// The chance, in [0, 1], that the box overlaps the target by half or more; with `paper` it only orders frames.
    pub score: f32,
    /// Whether the tracker believes the box.
    pub status: Status,
}
