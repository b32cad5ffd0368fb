//! `POST /sessions/{id}/frames`: the next frame, or several, get their boxes.

use super::advance::{Answered, NextFrames};
use super::answer::{FrameAnswers, replayed_header};
use super::frame_order::wait_for_turn;
use super::openapi::problem_responses::{self, operation_problems};
use super::openapi::request_bodies::{BinaryBody, FormBody, JsonBody};
use super::problems::kind::Kind;
use super::problems::problem::Problem;
use super::state::AppState;
use super::upload::session_request::{SessionRequest, renew_if_busy};
use super::upload::settings::{FrameCount, NumberInput, NumberText, Settings, WholeNumber};
use super::work;
use crate::sessions::WorkMeter;
use axum::Json;
use axum::extract::State;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;

/// The settings of a request with the next frames.
#[derive(Debug, Default, Deserialize, utoipa::IntoParams, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct FramesSettings {
    /// The number of the (first) frame of this request.
    #[param(value_type = NumberText, inline, required = false)]
    #[schema(value_type = NumberInput, inline, required = false)]
    frame: Option<WholeNumber>,
}

impl Settings for FramesSettings {
    const FRAMES: FrameCount = FrameCount::Several;
    const SCHEMA_PREFIX: &'static str = "Frames";
}

type FramesForm = FormBody<FramesSettings>;
type FramesJson = JsonBody<FramesSettings>;

operation_problems!(
    Problems,
    problem_responses::UPLOAD,
    problem_responses::SESSION,
    &[
        Kind::FrameOutOfOrder,
        Kind::NotInOrder,
        Kind::FrameDiffers,
        Kind::FrameSizeMismatch,
        Kind::SessionBusy,
        Kind::RequestTooCostly,
    ]
);

/// Send the next frame, or several
///
/// One frame gets one answer; several, in order, get `{"answers": [...]}`. All frames of a request are decoded
/// before the first is tracked: if one is bad, none is taken.
///
/// Numbered frames can be sent again: `?frame=N` says that the (first) frame of this request is frame N. The next
/// number is processed, one that comes a little early waits for its turn, and the last request's numbers with the same
/// bytes get the stored answers again, with the header `Replayed: true`.
///
/// `curl --data-binary @next.jpg http://localhost:8080/sessions/$ID/frames`
#[utoipa::path(
    post, path = "/sessions/{id}/frames", tag = "sessions", operation_id = "postFrames",
    params(
        ("id" = Uuid, Path, description = "The session's id"),
        FramesSettings,
    ),
    request_body(
        description = "The frame in one of three forms; the second and third take several.",
        content(
            (BinaryBody = "image/jpeg"), (BinaryBody = "image/png"), (BinaryBody = "image/webp"),
            (FramesForm = "multipart/form-data"),
            (FramesJson = "application/json", example = json!({"frame": "/9j/4AAQSkZJRg…"})),
        )
    ),
    responses(
        (
            status = 200, description = "Where the target is", body = FrameAnswers,
            headers(
                ("Replayed" = bool, description = "`true` where these answers were given before"),
                ("Draining" = bool, description = "`true` where the service is about to end")
            )
        ),
        Problems
    )
)]
pub async fn post(
    State(state): State<AppState>,
    request: SessionRequest<FramesSettings>,
) -> Result<Response, Problem> {
    let next = NextFrames {
        number: request.upload.settings.frame.map(|number| number.0),
        files: request.upload.files,
        correction: None,
        kept: 0,
        sees: false,
    };
    wait_for_turn(&request.permit, next.number).await?;
    let queue = request.queue.for_frames(next.files.len());
    let limits = state.config.request_limits();
    let metrics = state.metrics.tracking.clone();
    let advance =
        move |locked: &mut _, meter: &mut WorkMeter| next.advance(locked, &limits, meter, &metrics);
    let session = request.permit.session().clone();
    let answered = work::on_session(&state, request.permit, queue, advance).await;
    let Answered {
        estimates,
        replayed,
        ..
    } = answered.inspect_err(|problem| renew_if_busy(&session, problem))?;
    let answers = Json(FrameAnswers::from(&estimates[..])).into_response();
    Ok(replayed_header(replayed, answers))
}
