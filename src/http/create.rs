//! `POST /sessions`: a first frame and a box, or a snapshot, open a session.

use super::answer::{ImageSize, TargetBox};
use super::openapi;
use super::problem::Problem;
use super::problem_kind::Kind;
use super::state::AppState;
use super::upload::{Form, Received, Upload};
use super::work;
use crate::sessions::{Fingerprint, SNAPSHOT_MAGIC, Session, State as SessionState};
use crate::tracker::{Params, Tracker};
use axum::Json;
use axum::extract::{Request, State};
use axum::http::StatusCode;
use axum::http::header::LOCATION;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use uuid::Uuid;

const FORM: Form = Form {
    settings: &["box", "preset", "seed", "params"],
    numbered: false,
    several: false,
};

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
    #[schema(value_type = Object, example = json!({"seed": 7}))]
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

/// A named set of the tracker's parameters.
#[derive(utoipa::ToSchema)]
#[schema(as = Preset)]
#[serde(rename_all = "snake_case")]
#[expect(dead_code, reason = "a schema; the names are read by `upload`")]
enum PresetName {
    /// The equations and numbers of the paper.
    Paper,
    /// The default: mended where the printed equations lose the object.
    Robust,
}

/// A form with one frame and the settings of a new session.
#[derive(utoipa::ToSchema)]
#[expect(dead_code, reason = "a schema; the fields are read by `upload`")]
struct CreateForm {
    /// The first frame: a JPEG, PNG or WebP file. Or a session snapshot; then nothing else is given.
    #[schema(format = Binary, content_media_type = "application/octet-stream")]
    frame: String,
    /// `x,y,width,height`, or a JSON object with these names. May be in the query instead.
    #[schema(example = "10,20,30,40")]
    #[schema(nullable = false)]
    r#box: Option<String>,
    /// `robust` (the default) or `paper`.
    #[schema(nullable = false)]
    preset: Option<PresetName>,
    /// Seed of all random draws; a random one when left out.
    #[schema(nullable = false)]
    seed: Option<u64>,
    /// A JSON object of parameters that are set otherwise than in the preset. Each has a range, and some have a limit together;
    /// see the call.
    #[schema(example = "{\"seed\": 7}")]
    #[schema(nullable = false)]
    params: Option<String>,
}

/// One frame as base64 and the settings of a new session.
#[derive(utoipa::ToSchema)]
#[expect(dead_code, reason = "a schema; the fields are read by `upload`")]
struct CreateJson {
    /// The first frame as base64 (or a data URL): a JPEG, PNG or WebP file, or a session snapshot.
    #[schema(content_encoding = "base64")]
    frame: String,
    /// The target's box; the text `x,y,width,height` is taken too. May be in the query instead.
    #[schema(nullable = false)]
    r#box: Option<TargetBox>,
    /// `robust` (the default) or `paper`.
    #[schema(nullable = false)]
    preset: Option<PresetName>,
    /// Seed of all random draws; a random one when left out.
    #[schema(nullable = false)]
    seed: Option<u64>,
    /// Parameters that are set otherwise than in the preset. Each has a range, and some have a limit together; see the call.
    #[schema(value_type = Option<Object>)]
    params: Option<()>,
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
        openapi::problems(&[openapi::UPLOAD, own])
    }
}

/// Open a session
///
/// The first frame and the target's box start the tracker. A session snapshot in the place of the frame, with
/// nothing else, restores that session under a new id; it goes on exactly where it stood.
///
/// Every parameter has a range, and the sizes that multiply have limits together, so that no session is out of proportion in
/// time or memory. With F numbers in a feature vector (patch_width × patch_height, and ten times that for `gradients`),
/// these are at most: particles × F, 1,100,000; (bag_size × (basis_dim + 1) + background_samples) × F, 1,000,000;
/// background_samples × (particles + bag_size × (history + 1)) × F, 110,000,000. And pinned is less than bag_size. A
/// parameter out of these answers `invalid-parameter`, with the limit in its detail.
///
/// `curl --data-binary @first.jpg 'http://localhost:8080/sessions?box=10,20,30,40'`
#[utoipa::path(
    post, path = "/sessions", tag = "sessions", operation_id = "createSession",
    params(
        ("box" = Option<String>, Query, description = "The target's box, `x,y,width,height`; may be in the body instead.", example = "10,20,30,40"),
        ("preset" = Option<PresetName>, Query, description = "`robust` when left out."),
        ("seed" = Option<u64>, Query, description = "Seed of all random draws; a random one when left out."),
        ("params" = Option<String>, Query, description = "A JSON object of parameters that are set otherwise than in the preset.", example = "{\"seed\": 7}"),
    ),
    request_body(
        description = "The first frame in one of three forms, or a snapshot.",
        content(
            (Vec<u8> = "image/jpeg"), (Vec<u8> = "image/png"), (Vec<u8> = "image/webp"),
            (CreateForm = "multipart/form-data"),
            (CreateJson = "application/json", example = json!({"frame": "/9j/4AAQSkZJRg…", "box": {"x": 10, "y": 20, "width": 30, "height": 40}, "seed": 7})),
            (Vec<u8> = "application/vnd.bagtrack.snapshot"),
        )
    ),
    responses(
        (status = 201, description = "The session is open", body = CreatedSession, headers(("Location" = String, description = "The session's path"))),
        Problems
    )
)]
pub async fn create(State(state): State<AppState>, request: Request) -> Result<Response, Problem> {
    let too_many = |_| Problem::too_many_sessions();
    let has_room = || state.registry.check_room().map_err(too_many);
    let Received { queue, upload, .. } = FORM.receive(&state, request, has_room).await?;
    let started = match is_snapshot(&upload) {
        true => restore(&state, queue, upload).await?,
        false => start(&state, queue, upload).await?,
    };
    let session = state.registry.insert(started).map_err(too_many)?;
    tracing::info!(session = %session.id(), "opened");
    let location = [(LOCATION, format!("/sessions/{}", session.id()))];
    let created = Json(CreatedSession::of(&state, &session));
    Ok((StatusCode::CREATED, location, created).into_response())
}

fn is_snapshot(upload: &Upload) -> bool {
    upload.is_snapshot || upload.frames[0].starts_with(SNAPSHOT_MAGIC)
}

async fn start(
    state: &AppState,
    queue: crate::sessions::QueuePermit,
    upload: Upload,
) -> Result<SessionState, Problem> {
    let target = upload.fields.target.ok_or_else(Problem::missing_box)?;
    let params = upload.fields.tracker_params()?;
    let limits = state.config.frame_limits();
    let start = move || {
        let frame = &work::decode(&upload.frames, &limits)?[0];
        let tracker = Tracker::new(frame, target, params).map_err(Problem::tracker)?;
        let fingerprint = Fingerprint::of(&upload.frames[0]);
        Ok(SessionState::new(tracker, fingerprint, target))
    };
    work::run(state, queue, start).await
}

async fn restore(
    state: &AppState,
    queue: crate::sessions::QueuePermit,
    upload: Upload,
) -> Result<SessionState, Problem> {
    if !upload.fields.is_empty() {
        let detail = "A snapshot holds the box and the parameters; leave out all settings.";
        return Err(Problem::malformed(detail));
    }
    let restore =
        move || SessionState::restore(&upload.frames[0]).map_err(Problem::invalid_snapshot);
    work::run(state, queue, restore).await
}
