//! `PUT /sessions/{id}/target`: the user corrects the box.

use super::answer::{Answer, TargetBox};
use super::frames::{check_size, replayed_header};
use super::openapi;
use super::problem::Problem;
use super::problem_kind::Kind;
use super::session_path::SessionPath;
use super::state::AppState;
use super::upload::{Form, Received};
use super::work;
use crate::ingest;
use crate::sessions::{Fingerprint, Locked, Turn};
use crate::tracker::{Estimate, Rect};
use axum::Json;
use axum::body::Bytes;
use axum::extract::{Request, State};
use axum::response::{IntoResponse, Response};

const FORM: Form = Form {
    settings: &["box"],
    numbered: true,
    several: false,
};

/// A form with a frame and the corrected box.
#[derive(utoipa::ToSchema)]
#[expect(dead_code, reason = "a schema; the fields are read by `upload`")]
struct TargetForm {
    /// The next frame: a JPEG, PNG or WebP file.
    #[schema(format = Binary, content_media_type = "application/octet-stream")]
    frame: String,
    /// `x,y,width,height`, or a JSON object with these names. May be in the query instead.
    #[schema(example = "10,20,30,40")]
    #[schema(nullable = false)]
    r#box: Option<String>,
}

/// A frame as base64 (or a data URL) and the corrected box.
#[derive(utoipa::ToSchema)]
#[expect(dead_code, reason = "a schema; the fields are read by `upload`")]
struct TargetJson {
    /// The next frame.
    #[schema(content_encoding = "base64")]
    frame: String,
    /// The corrected box; the text `x,y,width,height` is taken too. May be in the query instead.
    #[schema(nullable = false)]
    r#box: Option<TargetBox>,
}

struct Problems;

impl utoipa::IntoResponses for Problems {
    fn responses()
    -> std::collections::BTreeMap<String, utoipa::openapi::RefOr<utoipa::openapi::Response>> {
        let own = &[
            Kind::MissingBox,
            Kind::SessionNotFound,
            Kind::FrameOutOfOrder,
            Kind::FrameDiffers,
            Kind::FrameSizeMismatch,
            Kind::InvalidBox,
            Kind::SessionBusy,
        ];
        openapi::problems(&[openapi::UPLOAD, own])
    }
}

/// Correct the box
///
/// The frame counts as the session's next frame, with the box given as its answer. The tracker keeps what it knew of
/// the target and gains the new look. To correct the answer to a frame, send that frame again here; it gets a new
/// number.
///
/// `curl -X PUT --data-binary @frame.jpg 'http://localhost:8080/sessions/$ID/target?box=12,22,30,40'`
#[utoipa::path(
    put, path = "/sessions/{id}/target", tag = "sessions", operation_id = "putTarget",
    params(
        ("id" = Uuid, Path, description = "The session's id"),
        ("box" = Option<String>, Query, description = "The corrected box, `x,y,width,height`; may be in the body instead.", example = "10,20,30,40"),
        ("frame" = Option<u64>, Query, description = "The number of this frame; see `POST /sessions/{id}/frames`."),
    ),
    request_body(
        description = "The frame in one of three forms.",
        content(
            (Vec<u8> = "image/jpeg"), (Vec<u8> = "image/png"), (Vec<u8> = "image/webp"),
            (TargetForm = "multipart/form-data"),
            (TargetJson = "application/json", example = json!({"frame": "/9j/4AAQSkZJRg…", "box": {"x": 12, "y": 22, "width": 30, "height": 40}})),
        )
    ),
    responses(
        (status = 200, description = "The correction is taken", body = Answer, headers(("Replayed" = bool, description = "`true` where this answer was given before"))),
        Problems
    )
)]
pub async fn put(
    State(state): State<AppState>,
    path: SessionPath,
    request: Request,
) -> Result<Response, Problem> {
    let Received {
        admitted: place,
        queue,
        upload,
    } = FORM.receive(&state, request, || path.enter(&state)).await?;
    let target = upload.fields.target.ok_or_else(Problem::missing_box)?;
    let number = upload.fields.number;
    let limits = state.config.frame_limits();
    let (estimate, replayed) = work::on_session(&state, place, queue, false, move |locked| {
        correct(locked, number, &upload.frames, target, &limits)
    })
    .await?;
    let answer = Json(Answer::from(estimate)).into_response();
    Ok(replayed_header(replayed, answer))
}

/// The answer, and whether it was given before.
fn correct(
    locked: &mut Locked,
    number: Option<u64>,
    frames: &[Bytes],
    target: Rect,
    limits: &ingest::Limits,
) -> Result<(Estimate, bool), Problem> {
    let fingerprint = Fingerprint::of(&frames[0]);
    let turn = locked.state().turn(number, &[fingerprint], Some(target));
    if let Turn::Replay(estimates) = turn.map_err(Problem::replay)? {
        return Ok((estimates[0], true));
    }
    let frame = &work::decode(frames, limits)?[0];
    check_size(frame, locked.session().source_size())?;
    let estimate = locked.state().retarget(fingerprint, frame, target);
    Ok((estimate.map_err(Problem::tracker)?, false))
}
