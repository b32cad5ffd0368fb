//! The answer to a request that opens a session.

use super::answer::{ImageSize, with_standing};
use super::json::Json;
use super::target_box::TargetBox;
use crate::http::extract::overrides::ParamOverrides;
use axum::http::StatusCode;
use axum::http::header::LOCATION;
use axum::response::Response;
use bagtrack_sessions::{Opened, PerTarget, Session, box_warnings};
use serde::Serialize;
use std::time::{Duration, SystemTime};
use uuid::Uuid;

/// A new session.
#[derive(Debug, Serialize, utoipa::ToSchema)]
pub struct CreatedSession {
    /// The session's id.
    id: Uuid,
    /// The frame that the session stands at: 0 for a new one, the snapshot's for a restored one.
    #[schema(example = 0)]
    frame: u64,
    /// The box of that frame; of several targets the first one's.
    r#box: TargetBox,
    /// In a session that was opened with `boxes`: its boxes of that frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, min_items = 1, max_items = 16)]
    boxes: Option<Vec<TargetBox>>,
    /// What may be wrong with the boxes, in words for people.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, min_items = 1)]
    warnings: Option<Vec<String>>,
    /// The size that all frames of the session have.
    image: ImageSize,
    /// With `verbose`: the tracker's parameters, with the seed that was drawn when none was given.
    #[serde(rename = "parameters", skip_serializing_if = "Option::is_none")]
    #[schema(value_type = ParamOverrides, nullable = false, required = false)]
    params: Option<ParamOverrides>,
    /// When the session ends if no frame comes (RFC 3339); every frame moves this on.
    #[schema(format = DateTime, example = "2026-01-31T12:00:00Z")]
    expires_at: String,
}

impl CreatedSession {
    fn of(session: &Session, is_verbose: bool) -> Self {
        let opening = session.opening();
        let expires = SystemTime::UNIX_EPOCH + Duration::from_secs(opening.expires);
        let frame = opening.estimates.first().frame;
        let given = opening.estimates.map(|estimate| estimate.target);
        // The box of a snapshot is the tracker's.
        let warnings = (frame == 0)
            .then(|| box_warnings(given.as_slice(), session.source_size()))
            .flatten();
        let boxes = opening
            .estimates
            .map(|estimate| TargetBox::answered(estimate.target));
        Self {
            id: session.id(),
            frame,
            r#box: TargetBox::answered(opening.estimates.first().target),
            boxes: match boxes {
                PerTarget::One(_) => None,
                PerTarget::List(list) => Some(list),
            },
            warnings,
            image: session.source_size().into(),
            params: is_verbose.then(|| session.params().into()),
            expires_at: humantime::format_rfc3339_seconds(expires).to_string(),
        }
    }
}

/// The answer to the request that opened a session.
pub fn created(opened: &Opened, is_verbose: bool) -> Response {
    let session = &opened.session;
    let location = [(LOCATION, format!("/sessions/{}", session.id()))];
    let body = Json(CreatedSession::of(session, is_verbose));
    let response = (StatusCode::CREATED, location, body);
    with_standing(opened.replayed, session.checkpoint(), response)
}
