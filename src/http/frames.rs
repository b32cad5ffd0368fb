//! `POST /sessions/{id}/frames`: the next frame, or several, get their boxes.

use super::answer::{Answer, Answers};
use super::openapi;
use super::problem::Problem;
use super::problem_kind::Kind;
use super::session_path::SessionPath;
use super::state::AppState;
use super::upload::{Form, Received};
use super::work;
use crate::ingest;
use crate::sessions::{Fingerprint, Locked, Turn};
use crate::tracker::{Estimate, GrayFrame, TrackerError};
use axum::Json;
use axum::body::Bytes;
use axum::extract::{Request, State};
use axum::response::{IntoResponse, Response};
use std::time::Instant;

const FORM: Form = Form {
    settings: &[],
    numbered: true,
    several: true,
};

/// A form with frames.
#[derive(utoipa::ToSchema)]
#[expect(dead_code, reason = "a schema; the fields are read by `upload`")]
struct FramesForm {
    /// A JPEG, PNG or WebP file; the part may come several times.
    #[schema(format = Binary, content_media_type = "application/octet-stream")]
    frame: Vec<String>,
}

/// Frames as base64 (or data URLs): `frame` for one, `frames` for several.
#[derive(utoipa::ToSchema)]
#[expect(dead_code, reason = "a schema; the fields are read by `upload`")]
struct FramesJson {
    /// One frame.
    #[schema(content_encoding = "base64")]
    #[schema(nullable = false)]
    frame: Option<String>,
    /// Several frames, in order.
    #[schema(nullable = false)]
    frames: Option<Vec<String>>,
}

/// One answer for one frame; a list of answers for several.
#[derive(utoipa::ToSchema)]
#[serde(untagged)]
#[expect(dead_code, reason = "a schema; the two are sent as they are")]
enum FrameAnswers {
    One(Answer),
    Several(Answers),
}

struct Problems;

impl utoipa::IntoResponses for Problems {
    fn responses()
    -> std::collections::BTreeMap<String, utoipa::openapi::RefOr<utoipa::openapi::Response>> {
        let own = &[
            Kind::SessionNotFound,
            Kind::FrameOutOfOrder,
            Kind::FrameDiffers,
            Kind::FrameSizeMismatch,
            Kind::SessionBusy,
        ];
        openapi::problems(&[openapi::UPLOAD, own])
    }
}

/// Send the next frame, or several
///
/// One frame gets one answer; several, in order, get `{"answers": [...]}`. All frames of a request are decoded
/// before the first is tracked: if one is bad, none is taken.
///
/// Numbered frames can be sent again: `?frame=N` says that the (first) frame of this request is frame N. The next
/// number is processed; the last request's numbers with the same bytes get the stored answers again, with the
/// header `Replayed: true`.
///
/// `curl --data-binary @next.jpg http://localhost:8080/sessions/$ID/frames`
#[utoipa::path(
    post, path = "/sessions/{id}/frames", tag = "sessions", operation_id = "postFrames",
    params(
        ("id" = Uuid, Path, description = "The session's id"),
        ("frame" = Option<u64>, Query, description = "The number of the (first) frame of this request."),
    ),
    request_body(
        description = "The frame in one of three forms; the second and third take several.",
        content(
            (Vec<u8> = "image/jpeg"), (Vec<u8> = "image/png"), (Vec<u8> = "image/webp"),
            (FramesForm = "multipart/form-data"),
            (FramesJson = "application/json", example = json!({"frame": "/9j/4AAQSkZJRg…"})),
        )
    ),
    responses(
        (status = 200, description = "Where the target is", body = FrameAnswers, headers(("Replayed" = bool, description = "`true` where these answers were given before"))),
        Problems
    )
)]
pub async fn post(
    State(state): State<AppState>,
    path: SessionPath,
    request: Request,
) -> Result<Response, Problem> {
    let Received {
        admitted: place,
        queue,
        upload,
    } = FORM.receive(&state, request, || path.enter(&state)).await?;
    let number = upload.fields.number;
    let limits = state.config.frame_limits();
    let is_brief = work::is_brief(place.session(), &upload.frames);
    let (estimates, replayed) = work::on_session(&state, place, queue, is_brief, move |locked| {
        let started = Instant::now();
        let answered = advance(locked, number, &upload.frames, &limits);
        locked.session().took(started.elapsed());
        answered
    })
    .await?;
    let response = match estimates[..] {
        [one] => Json(Answer::from(one)).into_response(),
        _ => Json(Answers::from(&estimates[..])).into_response(),
    };
    Ok(replayed_header(replayed, response))
}

/// Marks an answer that was given before.
pub fn replayed_header(replayed: bool, response: Response) -> Response {
    match replayed {
        true => ([("replayed", "true")], response).into_response(),
        false => response,
    }
}

/// Refuses a frame whose size is not the session's.
pub fn check_size(frame: &GrayFrame, (width, height): (u32, u32)) -> Result<(), Problem> {
    let (got_width, got_height) = frame.source_size();
    if (got_width, got_height) == (width, height) {
        return Ok(());
    }
    Err(Problem::tracker(TrackerError::FrameSize {
        width,
        height,
        got_width,
        got_height,
    }))
}

/// The answers, and whether they were given before.
fn advance(
    locked: &mut Locked,
    number: Option<u64>,
    frames: &[Bytes],
    limits: &ingest::Limits,
) -> Result<(Vec<Estimate>, bool), Problem> {
    let fingerprints: Vec<Fingerprint> =
        frames.iter().map(|frame| Fingerprint::of(frame)).collect();
    let turn = locked.state().turn(number, &fingerprints, None);
    if let Turn::Replay(estimates) = turn.map_err(Problem::replay)? {
        return Ok((estimates, true));
    }
    let decoded = work::decode(frames, limits)?;
    let size = locked.session().source_size();
    for (index, frame) in decoded.iter().enumerate() {
        check_size(frame, size).map_err(|problem| problem.of_frame(index, frames.len()))?;
    }
    let decoded: Vec<_> = fingerprints.into_iter().zip(decoded).collect();
    let estimates = locked.state().step(&decoded);
    decoded
        .into_iter()
        .for_each(|(_, frame)| ingest::recycle(frame));
    let refused = |(index, error)| Problem::tracker(error).of_frame(index, frames.len());
    Ok((estimates.map_err(refused)?, false))
}
