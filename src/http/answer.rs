//! Boxes and answers as they are sent and received.

use crate::tracker::{Estimate, Rect, Status};
use serde::Serialize;

/// A box in the pixels of the uploaded frame; the origin is the frame's top-left corner. It may reach over
/// the edge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, utoipa::ToSchema)]
#[schema(as = Box, example = json!({"x": 10.0, "y": 20.0, "width": 30.0, "height": 40.0}))]
pub struct TargetBox {
    /// Left edge.
    x: f64,
    /// Top edge.
    y: f64,
    /// Width, above 0.
    width: f64,
    /// Height, above 0.
    height: f64,
}

impl From<Rect> for TargetBox {
    fn from(rect: Rect) -> Self {
        Self {
            x: rect.x,
            y: rect.y,
            width: rect.width,
            height: rect.height,
        }
    }
}

/// Whether the tracker believes its own box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = Status)]
pub enum AnswerStatus {
    /// The box is on the target.
    Tracking,
    /// The box may be on the target.
    Uncertain,
    /// The target is out of sight; the box is the best guess.
    Lost,
}

impl From<Status> for AnswerStatus {
    fn from(status: Status) -> Self {
        match status {
            Status::Tracking => Self::Tracking,
            Status::Uncertain => Self::Uncertain,
            Status::Lost => Self::Lost,
        }
    }
}

/// The answer to one frame.
#[derive(Debug, Clone, PartialEq, Serialize, utoipa::ToSchema)]
pub struct Answer {
    /// Which frame this answers; the first frame of a session is 0.
    #[schema(example = 1)]
    frame: u64,
    /// Where the target is.
    r#box: TargetBox,
    /// The chance that the box overlaps the target by half or more.
    #[schema(minimum = 0, maximum = 1, example = 0.87)]
    score: f32,
    /// `tracking`, `uncertain` or `lost`.
    status: AnswerStatus,
}

impl From<Estimate> for Answer {
    fn from(estimate: Estimate) -> Self {
        Self {
            frame: estimate.frame,
            r#box: estimate.target.into(),
            score: estimate.score,
            status: estimate.status.into(),
        }
    }
}

/// The answers to several frames, in the order of the frames.
#[derive(Debug, Clone, PartialEq, Serialize, utoipa::ToSchema)]
pub struct Answers {
    /// One answer a frame.
    answers: Vec<Answer>,
}

impl From<&[Estimate]> for Answers {
    fn from(estimates: &[Estimate]) -> Self {
        Self {
            answers: estimates.iter().copied().map(Answer::from).collect(),
        }
    }
}

/// Width and height of the session's frames, in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, utoipa::ToSchema)]
pub struct ImageSize {
    /// Width.
    #[schema(example = 320)]
    width: u32,
    /// Height.
    #[schema(example = 240)]
    height: u32,
}

impl From<(u32, u32)> for ImageSize {
    fn from((width, height): (u32, u32)) -> Self {
        Self { width, height }
    }
}
