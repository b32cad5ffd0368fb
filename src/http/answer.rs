//! Answers as they are sent.

use super::target_box::TargetBox;
use crate::tracker::{Estimate, Status};
use axum::response::{IntoResponse, Response};
use serde::Serialize;

/// How sure the tracker is of its box.
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
    /// One answer for each frame.
    answers: Vec<Answer>,
}

/// One answer for one frame; a list of answers for several.
#[derive(Debug, Clone, PartialEq, Serialize, utoipa::ToSchema)]
#[serde(untagged)]
pub enum FrameAnswers {
    /// The answer to the only frame.
    One(Answer),
    /// The answers to several frames.
    Several(Answers),
}

impl From<&[Estimate]> for FrameAnswers {
    fn from(estimates: &[Estimate]) -> Self {
        match *estimates {
            [one] => Self::One(one.into()),
            _ => Self::Several(Answers {
                answers: estimates.iter().copied().map(Answer::from).collect(),
            }),
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

/// Marks an answer that was given before.
pub fn replayed_header(replayed: bool, response: Response) -> Response {
    match replayed {
        true => ([("replayed", "true")], response).into_response(),
        false => response,
    }
}
