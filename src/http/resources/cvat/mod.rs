//! `POST /integrations/cvat`: what CVAT asks of a serverless tracker.
//!
//! In: a frame, and for each shape its corners or the state of the answer before. Out: the corners in this frame, and
//! the next states, which are signed snapshots. Nothing is kept here. The frame is decoded once, in the format that the
//! smallest target asks for; the trackers of larger ones reduce it to their own.
//!
//! What can go wrong: the frame is no image or of another size than the track's, a state was changed, a shape is no box.
//! Then none of the shapes is tracked.

mod message;
mod track;

use self::message::{CvatAnswer, CvatRequest, Targets};
use self::track::track;
use super::snapshot::charged;
use crate::http::auth::caller::Caller;
use crate::http::extract::admit::admit;
use crate::http::extract::json_body::JsonText;
use crate::http::extract::overrides::{self, ParamOverrides, PresetName};
use crate::http::extract::settings::{FrameCount, NumberInput, NumberText, Settings, WholeNumber};
use crate::http::extract::texts::Texts;
use crate::http::openapi::example_frames;
use crate::http::openapi::params_schema::ParametersText;
use crate::http::openapi::problem_responses::{self, operation_problems};
use crate::http::problems::kind::Kind;
use crate::http::problems::problem::Problem;
use crate::http::service::state::AppState;
use crate::http::service::work;
use crate::sessions::{ByteCharge, WorkMeter};
use axum::extract::{FromRequestParts, Request, State};
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;

/// The parameters of tracks that begin; one that goes on has its own.
#[derive(Debug, Default, Deserialize, utoipa::IntoParams, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct CvatSettings {
    /// `robust` (the default) or `paper`.
    #[param(nullable = false)]
    preset: Option<PresetName>,
    /// Seed of all random draws, which counts before that of `parameters`; a random one when left out.
    #[param(value_type = NumberText, inline, required = false)]
    #[schema(value_type = NumberInput, inline, required = false)]
    seed: Option<WholeNumber>,
    /// A JSON object of parameters that are set otherwise than in the preset.
    #[serde(rename = "parameters")]
    #[param(value_type = ParametersText, inline, required = false, example = "{\"seed\": 7}")]
    params: Option<ParamOverrides>,
}

impl Settings for CvatSettings {
    const FRAMES: FrameCount = FrameCount::One;
    const SCHEMA_PREFIX: &'static str = "Cvat";
}

operation_problems!(
    Problems,
    &[
        Kind::MalformedRequest,
        Kind::BodyTimeout,
        Kind::BodyTooLarge,
        Kind::FrameTooLarge,
        Kind::UnsupportedImage,
        Kind::FrameDamaged,
        Kind::QuotaExceeded,
        Kind::QueueFull,
        Kind::WorkTimeout,
        Kind::Unauthorized,
        Kind::Forbidden,
        Kind::InvalidBox,
        Kind::InvalidParameter,
        Kind::InvalidSnapshot,
        Kind::FrameSizeMismatch,
        Kind::RequestTooCostly,
    ],
    problem_responses::ALWAYS
);

/// Track for CVAT
///
/// The wire format of CVAT's serverless trackers: `docker/cvat` has the function that CVAT calls, which sends what it
/// gets to here. A shape without a state begins a track; one with a state goes on. A lost target has the shape null. Each
/// shape counts as a frame in quotas.
#[utoipa::path(
    post, path = "/integrations/cvat", tag = "integrations", operation_id = "trackForCvat",
    params(CvatSettings),
    request_body(
        description = "A frame, shapes and states",
        content = CvatRequest,
        example = json!({"image": example_frames::first(), "shapes": [[10, 20, 40, 60]], "states": []})
    ),
    responses(
        (status = 200, description = "Where the targets are, and the next states", body = CvatAnswer),
        Problems
    )
)]
pub async fn post(State(state): State<AppState>, request: Request) -> Result<Response, Problem> {
    let settings: CvatSettings = Texts::of_query::<CvatSettings>(request.uri())?.parse()?;
    let params = overrides::resolve(settings.preset, settings.seed, settings.params)?;
    let (mut parts, body) = request.into_parts();
    let caller = Caller::from_request_parts(&mut parts, &state).await?;
    caller.require_key()?;
    let admitted = admit(&state, &parts)?;
    let mut charge = ByteCharge::new(&state.uploads, admitted.bytes());
    let request = Request::from_parts(parts, body);
    let text = JsonText::read(&state, admitted, request).await?;
    let read = move |_: &mut WorkMeter| Targets::read(&text.bytes);
    let request = work::run(&state, text.queue.clone(), read).await?;
    text.permit.count_frames(request.targets.len())?;
    let queue = text.queue.for_frames(request.targets.len());
    let worker = state.clone();
    let track = move |meter: &mut WorkMeter| {
        let body = track(&worker, &request, &params, meter, &mut charge)?;
        Ok((body, charge))
    };
    let (body, charge) = work::run(&state, queue, track).await?;
    Ok(([(CONTENT_TYPE, "application/json")], charged(body, charge)).into_response())
}
