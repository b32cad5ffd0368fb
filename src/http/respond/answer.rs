//! Answers as they are sent: the tracker's estimates, sessions that were opened, and the header fields beside them.

use super::body::Json;
use axum::http::header::LOCATION;
use axum::http::{HeaderName, HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use bagtrack_api::requests::public_params;
use bagtrack_api::{
    Answer, CreatedSession, FrameAnswers, Particles, Rect, Status, StreamAnswer, TargetView,
    headers,
};
use bagtrack_sessions::{Estimates, Opened, PerTarget, Session};
use bagtrack_tracker::{self as tracker, Diagnostics, Estimate, box_warnings};
use std::time::{Duration, SystemTime};

/// The header of an answer that was given before.
pub const REPLAYED: HeaderName = HeaderName::from_static(headers::REPLAYED);
/// The header with the last frame whose state is in the store.
pub const CHECKPOINT: HeaderName = HeaderName::from_static(headers::CHECKPOINT);

/// Bytes of a target in an answer: the value, and its JSON with six numbers.
const TARGET_BYTES: usize = 256;
const MAX_PARTICLES: usize = 200;

/// A box of the tracker, rounded for an answer.
pub fn rect(target: tracker::Rect) -> Rect {
    Rect::from([target.x, target.y, target.width, target.height]).rounded()
}

/// Rounds a number to a multiple of `1 / parts`.
fn round(value: f64, parts: f64) -> f64 {
    (value * parts).round() / parts
}

fn target(estimate: &Estimate) -> TargetView {
    TargetView {
        rect: rect(estimate.target),
        score: round(estimate.score.into(), 1e3),
        status: match estimate.status {
            tracker::Status::Tracking => Status::Tracking,
            tracker::Status::Uncertain => Status::Uncertain,
            tracker::Status::Lost => Status::Lost,
        },
    }
}

/// The answer to one frame. `warnings` say what may be wrong with the box that was given.
pub fn answer(estimates: &Estimates, warnings: Option<Vec<String>>) -> Answer {
    Answer {
        frame: estimates.first().frame,
        first: target(estimates.first()),
        targets: match estimates {
            PerTarget::One(_) => None,
            PerTarget::List(list) => Some(list.iter().map(target).collect()),
        },
        warnings,
    }
}

/// The answers to all frames of a request, at least one. `warnings` say what may be wrong with the box that was given.
pub fn answers(all: &[Estimates], warnings: Option<Vec<String>>) -> FrameAnswers {
    let several = || all.iter().map(|one| answer(one, None)).collect();
    FrameAnswers {
        last: answer(&all[all.len() - 1], warnings),
        answers: (all.len() > 1).then(several),
    }
}

/// The answer to a frame in a stream or as a line; the caller sets the other fields.
pub fn stream_answer(estimates: &Estimates, warnings: Option<Vec<String>>) -> StreamAnswer {
    StreamAnswer {
        answer: answer(estimates, warnings),
        skipped: 0,
        replayed: false,
        checkpoint: None,
        draining: false,
        seen: None,
    }
}

/// The likeliest particles and the votes of the bag's entries, as they are sent.
pub fn particles(mut seen: Diagnostics) -> Particles {
    seen.particles.sort_by(|a, b| b.1.total_cmp(&a.1));
    let shown = seen.particles.iter().take(MAX_PARTICLES);
    let particles = shown.map(|(area, weight)| {
        let (x, y) = area.center();
        let [x, y, width] = [x, y, area.width].map(|value| round(value, 10.0));
        [x, y, width, round(*weight, 1e5)]
    });
    Particles {
        particles: particles.collect(),
        votes: seen.votes.iter().map(|vote| round(*vote, 1e4)).collect(),
    }
}

/// Most bytes of the answers to `frames` frames, as values and as JSON, in a session with `targets` targets.
pub fn answer_bytes(frames: usize, targets: usize) -> usize {
    // The first target stands beside the list, and the last answer beside the list of answers.
    (frames + 1) * (targets + 1) * TARGET_BYTES
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

fn description(session: &Session, is_verbose: bool) -> CreatedSession {
    let opening = session.opening();
    let expires = SystemTime::UNIX_EPOCH + Duration::from_secs(opening.expires);
    let frame = opening.estimates.first().frame;
    let given = opening.estimates.map(|estimate| estimate.target);
    // After frame 0, in a session from a snapshot, the box is the tracker's own and needs no warnings.
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
