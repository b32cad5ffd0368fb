//! The types of the bagtrack service's requests and answers, which the service and its clients share.
//!
//! A [`Rect`] is a target's box, an [`Answer`] the answer to a frame, a [`CreatedSession`] the answer to a request that
//! opens a session. A [`ProblemDocument`] tells of any failure; its [`ProblemKind`] comes from one catalogue. All are
//! read and written as JSON, by serde. With the feature `service`, `requests` has the settings of each call, as the
//! service reads them, and `openapi` the document that describes them.
//!
//! What can go wrong: a member that the service adds is unknown to an older client. So clients ignore unknown members
//! of answers; the service refuses requests with an unknown setting.

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
    /// A frame; its first bytes tell its format.
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
    /// `true` if this is the stored answer to a request that was sent again.
    pub const REPLAYED: &str = "replayed";
    /// The number of the last frame whose state is in the store.
    pub const CHECKPOINT: &str = "checkpoint";
    /// `true` if the service is about to end.
    pub const DRAINING: &str = "draining";
    /// With a picture: the answer as JSON.
    pub const ANSWER: &str = "answer";
}
