//! Opens a session from its first frame and a box, or from a snapshot.

use super::advance;
use super::answer::{ImageSize, replayed_header};
use super::create_request::{CreateRequest, CreateSettings};
use super::idempotency::StoredAnswer;
use super::problems::problem::Problem;
use super::state::AppState;
use super::target_box::TargetBox;
use super::upload::overrides::ParamOverrides;
use super::upload::uploaded::Upload;
use super::work;
use crate::sessions::{Fingerprint, QueuePermit, SNAPSHOT_MAGIC, Session, SessionState, WorkMeter};
use crate::tracker::{Params, Preset, Tracker};
use axum::body::Bytes;
use axum::http::StatusCode;
use axum::http::header::{CONTENT_TYPE, LOCATION};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use std::sync::Arc;
use uuid::Uuid;

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
    /// When the session ends if no frame comes (RFC 3339); every frame moves this on.
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

/// A session that was opened.
pub struct Opened {
    /// Its id.
    pub id: Uuid,
    /// The body of its answer.
    pub body: Bytes,
}

impl From<&StoredAnswer> for Opened {
    fn from(stored: &StoredAnswer) -> Self {
        Self {
            id: stored.session,
            body: stored.body.clone(),
        }
    }
}

impl Opened {
    /// The answer.
    pub fn response(self, replayed: bool) -> Response {
        let headers = [
            (LOCATION, format!("/sessions/{}", self.id)),
            (CONTENT_TYPE, "application/json".to_owned()),
        ];
        let response = (StatusCode::CREATED, headers, self.body).into_response();
        replayed_header(replayed, response)
    }
}

/// Opens the session of a request.
///
/// # Errors
/// The frame, the box, a parameter or the snapshot cannot be used, or there is no room.
pub async fn open(state: &AppState, request: CreateRequest) -> Result<Opened, Problem> {
    let CreateRequest {
        caller,
        account,
        queue,
        upload,
        ..
    } = request;
    let is_snapshot = upload.is_snapshot || upload.files[0].starts_with(SNAPSHOT_MAGIC);
    let opened = match is_snapshot {
        true => restore(state, queue, upload).await?,
        false => start(state, queue, upload).await?,
    };
    let (owner, held) = (caller.owner().clone(), account.session()?);
    let session = state.registry.insert(opened, owner, held)?;
    tracing::info!(session = session.short_id(), "opened");
    let body = serde_json::to_vec(&CreatedSession::of(state, &session));
    Ok(Opened {
        id: session.id(),
        body: body
            .map_err(|error| Problem::internal(Arc::new(error)))?
            .into(),
    })
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
    let metrics = state.metrics.tracking.clone();
    let start = move |meter: &mut WorkMeter| {
        let format = |source| params.frame_format(source, &target);
        let frame = &advance::decode(&upload.files, &limits, &format, meter, &metrics)?[0];
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
    let (keys, max_recent) = (state.access.snapshots.clone(), state.config.max_frames);
    let restore =
        move |_: &mut WorkMeter| Ok(SessionState::restore(&upload.files[0], &keys, max_recent)?);
    work::run(state, queue, restore).await
}
