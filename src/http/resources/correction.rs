//! `PUT /sessions/{id}/target`: the user corrects the box.

use crate::http::extract::admitted::SessionRequest;
use crate::http::extract::overrides::rect;
use crate::http::problems::problem::Problem;
use crate::http::respond::answer::{answer, with_standing};
use crate::http::respond::body::Json;
use crate::http::state::AppState;
use axum::extract::State;
use axum::response::Response;
use bagtrack_api::Answer;
use bagtrack_api::openapi::example_frames;
use bagtrack_api::requests::{BinaryBody, FormBody, JsonBody, TargetSettings};
use bagtrack_sessions::{FrameBatch, GivenBox};
use bagtrack_tracker::box_warnings;

type TargetForm = FormBody<TargetSettings>;
type TargetJson = JsonBody<TargetSettings>;

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
        TargetSettings,
    ),
    request_body(
        description = "The frame as a raw body (JPEG, PNG or WebP), as a form, or as JSON with base64.",
        content(
            (BinaryBody = "application/octet-stream"),
            (TargetForm = "multipart/form-data"),
            (
                TargetJson = "application/json",
                example = json!({
                    "frame": example_frames::next(),
                    "box": {"x": 12, "y": 22, "width": 30, "height": 40}
                })
            ),
        )
    ),
    responses(
        (
            status = 200, description = "The correction is taken", body = Answer,
            headers(
                ("Replayed" = bool, description = "`true` where this answer was given before"),
                ("Checkpoint" = u64, description = "With a store: the last frame whose state is in it"),
                ("Draining" = bool, description = "`true` where the service is about to end")
            )
        )
    )
)]
pub async fn put(
    State(state): State<AppState>,
    request: SessionRequest<TargetSettings>,
) -> Result<Response, Problem> {
    let (number, given) = asked(&request.upload.settings)?;
    let batch = FrameBatch::posted(number, request.upload.files, Some(given));
    let permit = request.permit;
    let size = permit.session().source_size();
    let queue = request.queue.for_frames(permit.session().target_count());
    let queue = state.service.wait_for_turn(&permit, queue, number).await?;
    let tracked = state.service.advance(permit, queue, batch).await?;
    let answer = answer(&tracked.estimates[0], box_warnings(&[given.to], size));
    Ok(with_standing(
        tracked.replayed,
        tracked.checkpoint,
        Json(answer),
    ))
}

/// The number of the frame, and the box in it.
fn asked(settings: &TargetSettings) -> Result<(Option<u64>, GivenBox), Problem> {
    let to = rect(settings.r#box.ok_or_else(Problem::missing_corrected_box)?);
    let target = settings.target.map(|number| number.as_index());
    let number = settings.frame.map(|number| number.0);
    Ok((number, GivenBox { target, to }))
}
