//! What the bagtrack service takes and answers, as types: what the service and its clients agree on.
//!
//! A [`Rect`] is a target's box, an [`Answer`] is what a frame gets, a [`CreatedSession`] is what opening one gets. A
//! [`ProblemDocument`] is what is said where anything fails; its [`ProblemKind`] comes from one catalogue. All of them
//! are read and written as JSON, by serde. `requests` (with the feature `service`) has the settings of each call, as
//! the service reads them, and `openapi` the document that says so.
//!
//! What can go wrong: a member that the service adds is unknown to an older client. So answers are read without looking
//! at what is not known; requests with an unknown setting are refused.

pub mod answer;
mod boxes;
#[cfg(feature = "service")]
pub mod openapi;
mod parameters;
mod problem;
mod problem_kind;
mod rect;
#[cfg(feature = "service")]
pub mod requests;
mod session;
mod stream;

pub use answer::{Answer, FrameAnswers, ImageSize, Status, TargetView, Tracked};
pub use boxes::{Boxes, MAX_TARGETS, NoBoxes};
pub use parameters::{Parameters, PresetName};
pub use problem::ProblemDocument;
pub use problem_kind::{PROBLEMS_PAGE, ProblemKind};
pub use rect::{NotABox, Rect};
pub use session::{CreatedSession, Health, SessionToken, SessionView, Version};
pub use stream::{FrameHeader, Hello, Particles, StreamAnswer};

/// The media types of what is sent.
pub mod media_types {
    /// A frame, of whatever format: its bytes tell that.
    pub const FRAME: &str = "application/octet-stream";
    /// A snapshot of a session.
    pub const SNAPSHOT: &str = "application/vnd.bagtrack.snapshot";
    /// A line of JSON for each frame.
    pub const LINES: &str = "application/x-ndjson";
    /// A problem document.
    pub const PROBLEM: &str = "application/problem+json";
}

/// The header fields that are the service's own, in lower case.
pub mod headers {
    /// `true` where an answer was given before.
    pub const REPLAYED: &str = "replayed";
    /// The last frame whose state is in the store.
    pub const CHECKPOINT: &str = "checkpoint";
    /// `true` where the service is about to end.
    pub const DRAINING: &str = "draining";
    /// With a picture: the answer as JSON.
    pub const ANSWER: &str = "answer";
}
