//! The answers to frames.

use super::rect::Rect;
use serde::{Deserialize, Serialize};

/// How sure the tracker is of its box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "service", derive(utoipa::ToSchema))]
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "service", derive(utoipa::ToSchema))]
pub struct Answer {
    /// Which frame this answers; the first frame of a session is 0.
    #[cfg_attr(feature = "service", schema(example = 1))]
    pub frame: u64,
    /// Where the target is; of several targets the first.
    #[serde(flatten)]
    pub first: TargetView,
    /// In a session that was opened with `boxes`: its targets, in the order of the boxes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(
        feature = "service",
        schema(nullable = false, min_items = 1, max_items = 16)
    )]
    pub targets: Option<Vec<TargetView>>,
    /// What may be wrong with the box that the request gave, in words for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "service", schema(nullable = false, min_items = 1))]
    pub warnings: Option<Vec<String>>,
}

impl Answer {
    /// All targets, in the order of their boxes.
    pub fn targets(&self) -> &[TargetView] {
        let first = std::slice::from_ref(&self.first);
        self.targets.as_deref().unwrap_or(first)
    }
}

/// Where a target is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "service", derive(utoipa::ToSchema))]
pub struct TargetView {
    /// Where the target is.
    #[serde(rename = "box")]
    pub rect: Rect,
    /// The chance that the box overlaps the target by half or more; with the preset `paper` it only orders frames.
    #[cfg_attr(feature = "service", schema(value_type = f32, minimum = 0, maximum = 1, example = 0.87))]
    pub score: f64,
    /// `tracking`, `uncertain` or `lost`.
    pub status: Status,
}

/// The answer to the last frame of a request, and where it had several, to each of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "service", derive(utoipa::ToSchema))]
pub struct FrameAnswers {
    /// The answer to the last frame.
    #[serde(flatten)]
    pub last: Answer,
    /// Where several frames were sent: one answer for each, in the order of the frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "service", schema(nullable = false, min_items = 2))]
    pub answers: Option<Vec<Answer>>,
}

impl FrameAnswers {
    /// The answers to all frames of the request, at least one.
    pub fn into_all(self) -> Vec<Answer> {
        let all = self.answers.filter(|answers| !answers.is_empty());
        all.unwrap_or_else(|| vec![self.last])
    }
}

/// The answers to the frames, and the track up to there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "service", derive(utoipa::ToSchema))]
pub struct Tracked {
    /// The answers.
    #[serde(flatten)]
    pub answers: FrameAnswers,
    /// The track up to here as base64, to be sent with the next frame.
    #[cfg_attr(
        feature = "service",
        schema(content_encoding = "base64", example = "iWJhZ3RyYWNrDQo…")
    )]
    pub snapshot: String,
}

/// Width and height of the session's frames, in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "service", derive(utoipa::ToSchema))]
pub struct ImageSize {
    /// Width.
    #[cfg_attr(feature = "service", schema(example = 320))]
    pub width: u32,
    /// Height.
    #[cfg_attr(feature = "service", schema(example = 240))]
    pub height: u32,
}

impl From<(u32, u32)> for ImageSize {
    fn from((width, height): (u32, u32)) -> Self {
        Self { width, height }
    }
}
