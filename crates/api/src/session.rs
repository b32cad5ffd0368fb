//! The answers about sessions, and about the service itself.

use super::answer::{Answer, ImageSize};
use super::parameters::Parameters;
use super::rect::Rect;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

/// A new session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "service", derive(utoipa::ToSchema))]
pub struct CreatedSession {
    /// The session's id.
    pub id: Uuid,
    /// The frame that the session stands at: 0 for a new one, the snapshot's for a restored one.
    #[cfg_attr(feature = "service", schema(example = 0))]
    pub frame: u64,
    /// The box of that frame; of several targets the first one's.
    #[serde(rename = "box")]
    pub rect: Rect,
    /// In a session that was opened with `boxes`: its boxes of that frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(
        feature = "service",
        schema(nullable = false, min_items = 1, max_items = 16)
    )]
    pub boxes: Option<Vec<Rect>>,
    /// What may be wrong with the boxes, in words for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "service", schema(nullable = false, min_items = 1))]
    pub warnings: Option<Vec<String>>,
    /// The size that all frames of the session have.
    pub image: ImageSize,
    /// With `verbose`: the tracker's parameters, with the seed that was drawn when none was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "service", schema(value_type = Parameters, nullable = false, required = false))]
    pub parameters: Option<Parameters>,
    /// When the session ends if no frame comes (RFC 3339). Every frame moves this on, and `GET` tells it then: a
    /// repeated creation gets the answer of the first.
    #[cfg_attr(feature = "service", schema(format = DateTime, example = "2026-01-31T12:00:00Z"))]
    pub expires_at: String,
}

/// The state of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "service", derive(utoipa::ToSchema))]
pub struct SessionView {
    /// The session's id.
    pub id: Uuid,
    /// Frames taken, the first one included.
    #[cfg_attr(feature = "service", schema(example = 2))]
    pub frames: u64,
    /// The last answer.
    pub answer: Answer,
    /// The size that all frames of the session have.
    pub image: ImageSize,
    /// The tracker's parameters; with `boxes` the seed is that of the first target.
    pub parameters: Parameters,
    /// When the session ends if no frame comes (RFC 3339); this request does not move it on.
    #[cfg_attr(feature = "service", schema(format = DateTime, example = "2026-01-31T12:00:00Z"))]
    pub expires_at: String,
}

/// A session token.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "service", derive(utoipa::ToSchema), schema(as = TokenView))]
pub struct SessionToken {
    /// The token, to be sent as `Authorization: Bearer …`.
    pub token: String,
    /// When it ends (RFC 3339), if the session lives so long.
    #[cfg_attr(feature = "service", schema(format = DateTime, example = "2026-01-31T12:00:00Z"))]
    pub expires_at: String,
}

/// The service runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "service", derive(utoipa::ToSchema))]
pub struct Health {
    /// `ok`; or `store-full` from `/readyz` while the store of sessions takes frames and no new sessions.
    #[cfg_attr(feature = "service", schema(example = "ok"))]
    pub status: String,
}

/// The program that answers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "service", derive(utoipa::ToSchema))]
pub struct Version {
    /// Always `bagtrack`.
    #[cfg_attr(feature = "service", schema(example = "bagtrack"))]
    pub name: String,
    /// Its version. Another one may write snapshots of another format, which are refused.
    #[cfg_attr(feature = "service", schema(example = "0.1.0"))]
    pub version: String,
}
