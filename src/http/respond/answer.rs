//! Answers as they are sent.

use super::target_box::TargetBox;
use axum::http::{HeaderName, HeaderValue};
use axum::response::{IntoResponse, Response};
use bagtrack_sessions::{Estimates, PerTarget};
use bagtrack_tracker::{Diagnostics, Estimate, Status};
use serde::Serialize;

/// The header of an answer that was given before.
pub const REPLAYED: HeaderName = HeaderName::from_static("replayed");
/// The header with the last frame whose state is in the store.
pub const CHECKPOINT: HeaderName = HeaderName::from_static("checkpoint");

/// Bytes of a target in an answer: the value, and its JSON with six numbers.
const TARGET_BYTES: usize = 256;
/// Most particles in an answer.
const MAX_PARTICLES: usize = 200;

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

    /// As the answer to the frame of this number.
    pub fn numbered(mut self, frame: u64) -> Self {
        self.frame = frame;
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

/// The answer to a frame in a stream or as a line.
#[derive(Debug, Clone, Serialize)]
pub struct StreamAnswer {
    #[serde(flatten)]
    answer: Answer,
    /// Frames before it that were skipped, with `drop=true`.
    #[serde(skip_serializing_if = "is_zero")]
    skipped: u64,
    /// Whether it was given before.
    #[serde(skip_serializing_if = "is_false")]
    replayed: bool,
    /// With a store: the last frame whose state is in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    checkpoint: Option<u64>,
    /// Whether the service is about to end.
    #[serde(skip_serializing_if = "is_false")]
    draining: bool,
    #[serde(flatten)]
    seen: Option<SeenView>,
}

/// What the tracker saw in the frame.
#[derive(Debug, Clone, Serialize)]
pub struct SeenView {
    /// For the likeliest particles, likeliest first: centre (x, y), width, and weight.
    particles: Vec<[f64; 4]>,
    /// For each entry of the bag, oldest first, its share of the vote for the best particle.
    votes: Vec<f64>,
}

impl From<Diagnostics> for SeenView {
    fn from(mut seen: Diagnostics) -> Self {
        seen.particles.sort_by(|a, b| b.1.total_cmp(&a.1));
        let shown = seen.particles.iter().take(MAX_PARTICLES);
        let round = |value: f64, digits: f64| (value * digits).round() / digits;
        let particles = shown.map(|(area, weight)| {
            let (x, y) = area.center();
            [
                round(x, 10.0),
                round(y, 10.0),
                round(area.width, 10.0),
                round(*weight, 1e5),
            ]
        });
        Self {
            particles: particles.collect(),
            votes: seen.votes.iter().map(|vote| round(*vote, 1e4)).collect(),
        }
    }
}

impl StreamAnswer {
    /// The answer to a frame before which so many were skipped.
    pub fn new(estimates: &Estimates, skipped: u64, replayed: bool, draining: bool) -> Self {
        Self {
            answer: estimates.into(),
            skipped,
            replayed,
            checkpoint: None,
            draining,
            seen: None,
        }
    }

    /// With the last frame whose state is in the store.
    pub fn with_checkpoint(mut self, checkpoint: Option<u64>) -> Self {
        self.checkpoint = checkpoint;
        self
    }

    /// With what may be wrong with the box that was given, where anything is.
    pub fn with_warnings(mut self, warnings: Option<Vec<String>>) -> Self {
        self.answer = self.answer.with_warnings(warnings);
        self
    }

    /// With what the tracker saw.
    pub fn with_seen(mut self, seen: Option<Diagnostics>) -> Self {
        self.seen = seen.map(SeenView::from);
        self
    }
}

fn is_zero(number: &u64) -> bool {
    *number == 0
}

fn is_false(flag: &bool) -> bool {
    !flag
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

/// Marks an answer that was given before, and with a store tells the last frame whose state is in it.
pub fn with_standing(
    replayed: bool,
    checkpoint: Option<u64>,
    response: impl IntoResponse,
) -> Response {
    let mut response = response.into_response();
    let headers = response.headers_mut();
    if replayed {
        headers.insert(REPLAYED, HeaderValue::from_static("true"));
    }
    if let Some(frame) = checkpoint {
        headers.insert(CHECKPOINT, HeaderValue::from(frame));
    }
    response
}
