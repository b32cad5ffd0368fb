//! `POST /sessions`: a first frame and a box, or a snapshot, open a session.

use super::advance;
use super::answer::ImageSize;
use super::clients::Account;
use super::openapi::param_limits;
use super::openapi::problem_responses::{self, problem_responses};
use super::openapi::request_bodies::{FormBody, JsonBody};
use super::problems::kind::Kind;
use super::problems::problem::Problem;
use super::state::AppState;
use super::target_box::TargetBox;
use super::upload::admit::admit;
use super::upload::overrides::{ParamOverrides, PresetName};
use super::upload::settings::{FrameCount, Settings, WholeNumber};
use super::upload::texts::Texts;
use super::upload::uploaded::Upload;
use super::work;
use crate::sessions::{Fingerprint, QueuePermit, SNAPSHOT_MAGIC, Session, SessionState, WorkMeter};
use crate::tracker::{Params, Preset, Tracker};
use axum::Json;
use axum::extract::{FromRequest, Request, State};
use axum::http::StatusCode;
use axum::http::header::LOCATION;
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use uuid::Uuid;

/// The settings of a new session.
#[derive(Debug, Default, PartialEq, Deserialize, utoipa::IntoParams, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct CreateSettings {
    /// The target's box: `x,y,width,height`, or a JSON object with these names. May be in the query or in the body.
    #[param(value_type = String, required = false, example = "10,20,30,40")]
    #[schema(nullable = false)]
    r#box: Option<TargetBox>,
    /// `robust` (the default) or `paper`.
    #[param(nullable = false)]
    #[schema(nullable = false)]
    preset: Option<PresetName>,
    /// Seed of all random draws; a random one when left out.
    #[param(value_type = u64, required = false)]
    #[schema(value_type = Option<u64>, nullable = false)]
    seed: Option<WholeNumber>,
    /// A JSON object of parameters that are set otherwise than in the preset. Each has a range, and some have a limit
    /// together; see the call.
    #[param(value_type = String, required = false, example = "{\"seed\": 7}")]
    #[schema(nullable = false)]
    params: Option<ParamOverrides>,
}

impl Settings for CreateSettings {
    const FRAMES: FrameCount = FrameCount::One;
    const SCHEMA_PREFIX: &'static str = "Create";
}

type CreateForm = FormBody<CreateSettings>;
type CreateJson = JsonBody<CreateSettings>;

/// A request to open a session, with its place in the queue.
#[derive(Debug)]
pub struct CreateRequest {
    account: Arc<Account>,
    queue: QueuePermit,
    upload: Upload<CreateSettings>,
}

impl FromRequest<AppState> for CreateRequest {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &AppState) -> Result<Self, Problem> {
        let texts = Texts::of_query::<CreateSettings>(request.uri())?;
        state.registry.check_room()?;
        let (parts, body) = request.into_parts();
        let client = admit(state, &parts)?;
        let account = client.account().clone();
        account.check_session()?;
        let request = Request::from_parts(parts, body);
        let (upload, queue) = Upload::read(state, client, texts, request).await?;
        Ok(Self {
            account,
            queue,
            upload,
        })
    }
}

/// A new session.
#[derive(Debug, Serialize, utoipa::ToSchema)]
pub struct CreatedSession {
    /// The session's id.
    id: Uuid,
    /// The frame that the session stands at: 0 for a new one, the snapshot's for a restored one.
    #[schema(example = 0)]
    frame: u64,
    /// The box of that frame.
    r#box: TargetBox,
    /// The size that all frames of the session have.
    image: ImageSize,
    /// The tracker's parameters, with the seed that was drawn when none was given.
    #[schema(value_type = ParamOverrides)]
    params: Params,
    /// When the session ends if it is not used again (RFC 3339); every request on it moves this on.
    #[schema(format = DateTime, example = "2026-01-31T12:00:00Z")]
    expires_at: String,
}

impl CreatedSession {
    fn of(state: &AppState, session: &Session) -> Self {
        let latest = session.latest();
        Self {
            id: session.id(),
            frame: latest.frame,
            r#box: latest.target.into(),
            image: session.source_size().into(),
            params: session.params().clone(),
            expires_at: state.expires_at(session),
        }
    }
}

struct Problems;

impl utoipa::IntoResponses for Problems {
    fn responses()
    -> std::collections::BTreeMap<String, utoipa::openapi::RefOr<utoipa::openapi::Response>> {
        let own = &[
            Kind::MissingBox,
            Kind::InvalidBox,
            Kind::InvalidParameter,
            Kind::InvalidSnapshot,
            Kind::TooManySessions,
        ];
        problem_responses(&[problem_responses::UPLOAD, own])
    }
}

/// Open a session
#[utoipa::path(
    post, path = "/sessions", tag = "sessions", operation_id = "createSession",
    description = param_limits::create_description(),
    params(CreateSettings),
    request_body(
        description = "The first frame in one of three forms, or a snapshot.",
        content(
            (Vec<u8> = "image/jpeg"), (Vec<u8> = "image/png"), (Vec<u8> = "image/webp"),
            (CreateForm = "multipart/form-data"),
            (
                CreateJson = "application/json",
                example = json!({
                    "frame": "/9j/4AAQSkZJRg…",
                    "box": {"x": 10, "y": 20, "width": 30, "height": 40},
                    "seed": 7
                })
            ),
            (Vec<u8> = "application/vnd.bagtrack.snapshot"),
        )
    ),
    responses(
        (
            status = 201, description = "The session is open", body = CreatedSession,
            headers(("Location" = String, description = "The session's path"))
        ),
        Problems
    )
)]
pub async fn create(
    State(state): State<AppState>,
    request: CreateRequest,
) -> Result<Response, Problem> {
    let CreateRequest {
        account,
        queue,
        upload,
    } = request;
    let is_snapshot = upload.is_snapshot || upload.files[0].starts_with(SNAPSHOT_MAGIC);
    let opened = match is_snapshot {
        true => restore(&state, queue, upload).await?,
        false => start(&state, queue, upload).await?,
    };
    let session = state.registry.insert(opened, account.session()?)?;
    tracing::info!(session = %session.id(), "opened");
    let location = [(LOCATION, format!("/sessions/{}", session.id()))];
    let created = Json(CreatedSession::of(&state, &session));
    Ok((StatusCode::CREATED, location, created).into_response())
}

async fn start(
    state: &AppState,
    queue: QueuePermit,
    upload: Upload<CreateSettings>,
) -> Result<SessionState, Problem> {
    let settings = upload.settings;
    let target = settings.r#box.ok_or_else(Problem::missing_box)?.into();
    let preset = settings.preset.map_or_else(Preset::default, Preset::from);
    let params = settings.params.unwrap_or_default();
    let params = params.resolve(preset, settings.seed.map(|seed| seed.0))?;
    let limits = state.config.frame_limits();
    let start = move |meter: &mut WorkMeter| {
        let frame = &advance::decode(&upload.files, &limits, meter)?[0];
        let tracker = Tracker::new(frame, target, params)?;
        let fingerprint = Fingerprint::of(&upload.files[0]);
        Ok(SessionState::new(tracker, fingerprint, target))
    };
    work::run(state, queue, start).await
}

async fn restore(
    state: &AppState,
    queue: QueuePermit,
    upload: Upload<CreateSettings>,
) -> Result<SessionState, Problem> {
    if upload.settings != CreateSettings::default() {
        let detail = "A snapshot holds the box and the parameters; leave out all settings.";
        return Err(Problem::malformed(detail));
    }
    let restore = move |_: &mut WorkMeter| Ok(SessionState::restore(&upload.files[0])?);
    work::run(state, queue, restore).await
}
