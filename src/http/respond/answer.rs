//! Answers as they are sent.

use super::target_box::TargetBox;
use axum::response::{IntoResponse, Response};
use bagtrack_sessions::{Estimates, PerTarget};
use bagtrack_tracker::{Estimate, Status};
use serde::Serialize;

/// Bytes of a target in an answer: the value, and its JSON with six numbers.
const TARGET_BYTES: usize = 256;

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
    /// Where the target is; of several targets the first.
    #[serde(flatten)]
    first: TargetView,
    /// In a session that was opened with `boxes`: its targets, in the order of the boxes.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, min_items = 1, max_items = 16)]
    targets: Option<Vec<TargetView>>,
    /// What may be wrong with the box that the request gave, in words for people.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, min_items = 1)]
    warnings: Option<Vec<String>>,
}

/// Where a target is.
#[derive(Debug, Clone, PartialEq, Serialize, utoipa::ToSchema)]
pub struct TargetView {
    /// Where the target is.
    r#box: TargetBox,
    /// The chance that the box overlaps the target by half or more.
    #[schema(minimum = 0, maximum = 1, example = 0.87)]
    score: f32,
    /// `tracking`, `uncertain` or `lost`.
    status: AnswerStatus,
}

impl From<&Estimate> for TargetView {
    fn from(estimate: &Estimate) -> Self {
        Self {
            r#box: TargetBox::answered(estimate.target),
            score: rounded(estimate.score),
            status: estimate.status.into(),
        }
    }
}

impl Answer {
    /// With what may be wrong with the box that was given, where anything is.
    pub fn with_warnings(mut self, warnings: Option<Vec<String>>) -> Self {
        self.warnings = warnings;
        self
    }
}

impl From<&Estimates> for Answer {
    fn from(estimates: &Estimates) -> Self {
        let first = estimates.first();
        Self {
            frame: first.frame,
            first: first.into(),
            targets: match estimates {
                PerTarget::One(_) => None,
                PerTarget::List(list) => Some(list.iter().map(TargetView::from).collect()),
            },
            warnings: None,
        }
    }
}

/// A score as it is answered: to a thousandth.
fn rounded(score: f32) -> f32 {
    ((f64::from(score) * 1000.0).round() / 1000.0) as f32
}

/// The answer to the last frame of a request, and where it had several, to each of them.
#[derive(Debug, Clone, PartialEq, Serialize, utoipa::ToSchema)]
pub struct FrameAnswers {
    /// The answer to the last frame.
    #[serde(flatten)]
    last: Answer,
    /// Where several frames were sent: one answer for each, in the order of the frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, min_items = 2)]
    answers: Option<Vec<Answer>>,
}

impl From<&[Estimates]> for FrameAnswers {
    /// From the answers to all frames of a request, which has at least one.
    fn from(estimates: &[Estimates]) -> Self {
        let all = || estimates.iter().map(Answer::from).collect();
        Self {
            last: (&estimates[estimates.len() - 1]).into(),
            answers: (estimates.len() > 1).then(all),
        }
    }
}

impl FrameAnswers {
    /// With what may be wrong with the box that was given, where anything is.
    pub fn with_warnings(mut self, warnings: Option<Vec<String>>) -> Self {
        self.last = self.last.with_warnings(warnings);
        self
    }
}

/// Bytes that the answers to so many frames take at most, as values and as JSON, in a session with so many targets.
pub fn answer_bytes(frames: usize, targets: usize) -> usize {
    // The first target stands beside the list, and the last answer beside the list of answers.
    (frames + 1) * (targets + 1) * TARGET_BYTES
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
