//! `PUT /sessions/{id}/target`: the user corrects the box.

use super::advance::{Answered, NextFrames};
use super::answer::{Answer, replayed_header};
use super::frame_order::wait_for_turn;
use super::openapi::problem_responses::{self, operation_problems};
use super::openapi::request_bodies::{BinaryBody, FormBody, JsonBody};
use super::problems::kind::Kind;
use super::problems::problem::Problem;
use super::state::AppState;
use super::target_box::{BoxInput, BoxText, TargetBox};
use super::upload::session_request::{SessionRequest, renew_if_busy};
use super::upload::settings::{FrameCount, NumberInput, NumberText, Settings, WholeNumber};
use super::work;
use crate::sessions::WorkMeter;
use axum::Json;
use axum::extract::State;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;

/// The settings of a correction.
#[derive(Debug, Default, Deserialize, utoipa::IntoParams, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct TargetSettings {
    /// The corrected box: `x,y,width,height`, or a JSON object with these names. In the query or in the
    /// body; that of the body counts.
    #[param(value_type = BoxText, inline, required = false, example = "10,20,30,40")]
    #[schema(value_type = BoxInput, inline, required = false)]
    r#box: Option<TargetBox>,
    /// The number of this frame; see `POST /sessions/{id}/frames`.
    #[param(value_type = NumberText, inline, required = false)]
    #[schema(value_type = NumberInput, inline, required = false)]
    frame: Option<WholeNumber>,
}

impl Settings for TargetSettings {
    const FRAMES: FrameCount = FrameCount::One;
    const SCHEMA_PREFIX: &'static str = "Target";
}

type TargetForm = FormBody<TargetSettings>;
type TargetJson = JsonBody<TargetSettings>;

operation_problems!(
    Problems,
    problem_responses::UPLOAD,
    problem_responses::SESSION,
    &[
        Kind::MissingBox,
        Kind::FrameOutOfOrder,
        Kind::NotInOrder,
        Kind::FrameDiffers,
        Kind::FrameSizeMismatch,
        Kind::InvalidBox,
        Kind::SessionBusy,
    ]
);

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
        description = "The frame in one of three forms.",
        content(
            (BinaryBody = "image/jpeg"), (BinaryBody = "image/png"), (BinaryBody = "image/webp"),
            (TargetForm = "multipart/form-data"),
            (
                TargetJson = "application/json",
                example = json!({
                    "frame": "/9j/4AAQSkZJRg…",
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
                ("Draining" = bool, description = "`true` where the service is about to end")
            )
        ),
        Problems
    )
)]
pub async fn put(
    State(state): State<AppState>,
    request: SessionRequest<TargetSettings>,
) -> Result<Response, Problem> {
    let settings = request.upload.settings;
    let target = settings.r#box.ok_or_else(Problem::missing_box)?;
    let next = NextFrames {
        number: settings.frame.map(|number| number.0),
        files: request.upload.files,
        correction: Some(target.into()),
        kept: 0,
        sees: false,
    };
    wait_for_turn(&request.permit, next.number).await?;
    let limits = state.config.request_limits();
    let metrics = state.metrics.tracking.clone();
    let correct =
        move |locked: &mut _, meter: &mut WorkMeter| next.advance(locked, &limits, meter, &metrics);
    let session = request.permit.session().clone();
    let answered = work::on_session(&state, request.permit, request.queue, correct).await;
    let Answered {
        estimates,
        replayed,
        ..
    } = answered.inspect_err(|problem| renew_if_busy(&session, problem))?;
    let answer = Json(Answer::from(estimates[0])).into_response();
    Ok(replayed_header(replayed, answer))
}
