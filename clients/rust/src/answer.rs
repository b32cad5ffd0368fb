//! Where the targets are in a frame.

use reqwest::header::HeaderMap;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A box in pixels of the uploaded frame, counted from 0 at its top-left corner. It may reach over the edge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rect {
    /// Left edge.
    pub x: f64,
    /// Top edge.
    pub y: f64,
    /// Width, above 0.
    pub width: f64,
    /// Height, above 0.
    pub height: f64,
}

/// `x,y,width,height`, as queries have it: all digits of the numbers.
impl fmt::Display for Rect {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self {
            x,
            y,
            width,
            height,
        } = self;
        write!(f, "{x},{y},{width},{height}")
    }
}

/// How sure the tracker is of its box.
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

/// Where a target is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Its box.
    #[serde(rename = "box")]
    pub rect: Rect,
    /// The chance that the box overlaps the target by half or more, from 0 to 1.
    pub score: f64,
    /// What the score and its history mean.
    pub status: Status,
}

/// The answer to a frame. With serde it is written as the service writes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Answer {
    /// The frame's number; the first frame of a session is 0.
    pub frame: u64,
    /// The target's box; of several targets the first one's.
    #[serde(rename = "box")]
    pub rect: Rect,
    /// The chance that the box overlaps the target by half or more, from 0 to 1.
    pub score: f64,
    /// What the score and its history mean.
    pub status: Status,
    /// In a session that was opened with a list of boxes: its targets, in that order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub targets: Vec<Target>,
    /// From a service with a store: the last frame whose state is in the store.
    #[serde(skip)]
    pub checkpoint: Option<u64>,
    /// Whether the service is about to end. The session goes on elsewhere by itself, where there is another one.
    #[serde(skip)]
    pub draining: bool,
}

impl Answer {
    /// Notes what the headers say.
    pub(crate) fn note(&mut self, headers: &HeaderMap) {
        let says = |name: &str, text: &str| headers.get(name).is_some_and(|value| value == text);
        self.checkpoint = headers
            .get("checkpoint")
            .and_then(|value| value.to_str().ok()?.parse().ok());
        self.draining = says("draining", "true");
    }
}
