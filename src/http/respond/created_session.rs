//! The answer to a request that opens a session.

use super::answer::{rect, with_standing};
use super::body::Json;
use axum::http::StatusCode;
use axum::http::header::LOCATION;
use axum::response::Response;
use bagtrack_api::CreatedSession;
use bagtrack_api::requests::public_params;
use bagtrack_sessions::{Opened, PerTarget, Session};
use bagtrack_tracker::box_warnings;
use std::time::{Duration, SystemTime};

fn description(session: &Session, is_verbose: bool) -> CreatedSession {
    let opening = session.opening();
    let expires = SystemTime::UNIX_EPOCH + Duration::from_secs(opening.expires);
    let frame = opening.estimates.first().frame;
    let given = opening.estimates.map(|estimate| estimate.target);
    // The box of a snapshot is the tracker's.
    let warnings = (frame == 0)
        .then(|| box_warnings(given.as_slice(), session.source_size()))
        .flatten();
    CreatedSession {
        id: session.id(),
        frame,
        rect: rect(*given.first()),
        boxes: match given {
            PerTarget::One(_) => None,
            PerTarget::List(list) => Some(list.into_iter().map(rect).collect()),
        },
        warnings,
        image: session.source_size().into(),
        parameters: is_verbose.then(|| public_params(session.params())),
        expires_at: humantime::format_rfc3339_seconds(expires).to_string(),
    }
}

/// The answer to the request that opened a session.
pub fn created(opened: &Opened, is_verbose: bool) -> Response {
    let session = &opened.session;
    let location = [(LOCATION, format!("/sessions/{}", session.id()))];
    let body = Json(description(session, is_verbose));
    let response = (StatusCode::CREATED, location, body);
    with_standing(opened.replayed, session.checkpoint(), response)
}
