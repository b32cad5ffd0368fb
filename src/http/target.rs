//! `PUT /sessions/{id}/target`: the user corrects the box.

use super::advance::{Answered, NextFrames};
use super::answer::{Answer, replayed_header};
use super::frame_order::wait_for_turn;
use super::openapi::problem_responses::{self, problem_responses};
use super::openapi::request_bodies::{FormBody, JsonBody};
use super::problems::kind::Kind;
use super::problems::problem::Problem;
use super::state::AppState;
use super::target_box::TargetBox;
use super::upload::session_request::SessionRequest;
use super::upload::settings::{FrameCount, Settings, WholeNumber};
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
    /// The corrected box: `x,y,width,height`, or a JSON object with these names. May be in the query or in the body.
    #[param(value_type = String, required = false, example = "10,20,30,40")]
    #[schema(nullable = false)]
    r#box: Option<TargetBox>,
    /// The number of this frame; see `POST /sessions/{id}/frames`.
    #[param(value_type = u64, required = false)]
    #[schema(value_type = Option<u64>, nullable = false)]
    frame: Option<WholeNumber>,
}

impl Settings for TargetSettings {
    const FRAMES: FrameCount = FrameCount::One;
    const SCHEMA_PREFIX: &'static str = "Target";
}

type TargetForm = FormBody<TargetSettings>;
type TargetJson = JsonBody<TargetSettings>;

struct Problems;

impl utoipa::IntoResponses for Problems {
    fn responses()
    -> std::collections::BTreeMap<String, utoipa::openapi::RefOr<utoipa::openapi::Response>> {
        let own = &[
            Kind::MissingBox,
            Kind::FrameOutOfOrder,
            Kind::NotInOrder,
            Kind::FrameDiffers,
            Kind::FrameSizeMismatch,
            Kind::InvalidBox,
            Kind::SessionBusy,
        ];
        problem_responses(&[problem_responses::UPLOAD, problem_responses::SESSION, own])
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
        TargetSettings,
    ),
    request_body(
        description = "The frame in one of three forms.",
        content(
            (Vec<u8> = "image/jpeg"), (Vec<u8> = "image/png"), (Vec<u8> = "image/webp"),
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
    let Answered {
        estimates,
        replayed,
        ..
    } = work::on_session(&state, request.permit, request.queue, correct).await?;
    let answer = Json(Answer::from(estimates[0])).into_response();
    Ok(replayed_header(replayed, answer))
}
