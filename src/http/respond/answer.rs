//! Answers as they are sent: of what the tracker says, and the header fields beside them.

use axum::http::{HeaderName, HeaderValue};
use axum::response::{IntoResponse, Response};
use bagtrack_api::{
    Answer, FrameAnswers, Particles, Rect, Status, StreamAnswer, TargetView, headers,
};
use bagtrack_sessions::{Estimates, PerTarget};
use bagtrack_tracker::{self as tracker, Diagnostics, Estimate};

/// The header of an answer that was given before.
pub const REPLAYED: HeaderName = HeaderName::from_static(headers::REPLAYED);
/// The header with the last frame whose state is in the store.
pub const CHECKPOINT: HeaderName = HeaderName::from_static(headers::CHECKPOINT);

/// Bytes of a target in an answer: the value, and its JSON with six numbers.
const TARGET_BYTES: usize = 256;
const MAX_PARTICLES: usize = 200;

/// A box as it is answered.
pub fn rect(target: tracker::Rect) -> Rect {
    Rect::from([target.x, target.y, target.width, target.height]).rounded()
}

/// A number to this part of one.
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

/// The answer to one frame, with what may be wrong with the box that was given.
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

/// The answers to all frames of a request, which has at least one, with what may be wrong with the box that was given.
pub fn answers(all: &[Estimates], warnings: Option<Vec<String>>) -> FrameAnswers {
    let several = || all.iter().map(|one| answer(one, None)).collect();
    FrameAnswers {
        last: answer(&all[all.len() - 1], warnings),
        answers: (all.len() > 1).then(several),
    }
}

/// The answer to a frame in a stream or as a line; the caller sets what is known beside it.
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

/// What the tracker saw, as it is answered.
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

/// Bytes that the answers to so many frames take at most, as values and as JSON, in a session with so many targets.
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
