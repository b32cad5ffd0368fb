//! Opens a session from its first frame and a box, or from a snapshot.

use super::first_frame::FirstFrame;
use super::state::AppState;
use super::work;
use crate::http::extract::overrides::ParamOverrides;
use crate::http::extract::uploaded::Upload;
use crate::http::problems::problem::Problem;
use crate::http::resources::create_request::{CreateRequest, CreateSettings};
use crate::http::respond::answer::{ImageSize, replayed_header};
use crate::http::respond::checkpoint::with_checkpoint;
use crate::http::respond::json::Json;
use crate::http::respond::target_box::TargetBox;
use crate::http::respond::target_boxes::boxes_of;
use crate::sessions::{
    InsertError, NewSession, Opening, Owner, PerTarget, QueuePermit, Record, Reply, SNAPSHOT_MAGIC,
    Session, SessionState, Version, WorkMeter,
};
use crate::tracker::Params;
use axum::http::StatusCode;
use axum::http::header::LOCATION;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use std::sync::Arc;
use std::time::{Duration, SystemTime};
use uuid::Uuid;

/// A new session.
#[derive(Debug, Serialize, utoipa::ToSchema)]
pub struct CreatedSession {
    /// The session's id.
    id: Uuid,
    /// The frame that the session stands at: 0 for a new one, the snapshot's for a restored one.
    #[schema(example = 0)]
    frame: u64,
    /// The box of that frame; of several targets the first one's.
    r#box: TargetBox,
    /// In a session that was opened with `boxes`: its boxes of that frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, min_items = 1, max_items = 16)]
    boxes: Option<Vec<TargetBox>>,
    /// The size that all frames of the session have.
    image: ImageSize,
    /// With `verbose`: the tracker's parameters, with the seed that was drawn when none was given.
    #[serde(rename = "parameters", skip_serializing_if = "Option::is_none")]
    #[schema(value_type = ParamOverrides, nullable = false, required = false)]
    params: Option<Params>,
    /// When the session ends if no frame comes (RFC 3339); every frame moves this on.
    #[schema(format = DateTime, example = "2026-01-31T12:00:00Z")]
    expires_at: String,
}

impl CreatedSession {
    fn of(session: &Session, is_verbose: bool) -> Self {
        let opening = session.opening();
        let expires = SystemTime::UNIX_EPOCH + Duration::from_secs(opening.expires);
        let boxes = opening
            .estimates
            .map(|estimate| TargetBox::answered(estimate.target));
        Self {
            id: session.id(),
            frame: opening.estimates.first().frame,
            r#box: TargetBox::answered(opening.estimates.first().target),
            boxes: match boxes {
                PerTarget::One(_) => None,
                PerTarget::List(list) => Some(list),
            },
            image: session.source_size().into(),
            params: is_verbose.then(|| session.params().clone()),
            expires_at: humantime::format_rfc3339_seconds(expires).to_string(),
        }
    }
}

/// The answer to the request that opened a session.
pub fn created(session: &Session, replayed: bool, is_verbose: bool) -> Response {
    let location = [(LOCATION, format!("/sessions/{}", session.id()))];
    let body = Json(CreatedSession::of(session, is_verbose));
    let response = (StatusCode::CREATED, location, body).into_response();
    with_checkpoint(session.checkpoint(), replayed_header(replayed, response))
}

/// Opens the session of a request, under this id.
///
/// # Errors
/// The frame, the box, a parameter or the snapshot cannot be used, there is no room, or a live session has the id.
pub async fn open(
    state: &AppState,
    request: CreateRequest,
    id: Uuid,
) -> Result<Arc<Session>, Problem> {
    let digest = request.digest();
    let CreateRequest {
        caller,
        account,
        queue,
        upload,
        ..
    } = request;
    let is_snapshot = upload.is_snapshot || upload.files[0].starts_with(SNAPSHOT_MAGIC);
    let opened = match is_snapshot {
        true => restore(state, queue.clone(), upload).await?,
        false => start(state, queue.clone(), upload).await?,
    };
    let (opened, stored) = match &state.store {
        None => (opened, Vec::new()),
        Some(_) => {
            let store = move |_: &mut WorkMeter| {
                let bytes = opened.stored();
                Ok((opened, bytes))
            };
            work::run(state, queue, store).await?
        }
    };
    let held = account.sessions(opened.target_count())?;
    let owner = caller.owner().clone();
    let opening = state.registry.opening(digest, &opened);
    let version = create_record(state, stored, id, &owner, opening.clone()).await?;
    let session = state.registry.insert(NewSession {
        id,
        opening,
        owner,
        version,
        lives: state.registry.first_lease(),
        state: opened,
        held,
    })?;
    tracing::info!(session = session.short_id(), "opened");
    Ok(session)
}

/// Adds the session to the store, where there is one. Tells the version of its record.
async fn create_record(
    state: &AppState,
    stored: Vec<u8>,
    id: Uuid,
    owner: &Owner,
    opening: Opening,
) -> Result<Option<Version>, Problem> {
    let Some(store) = &state.store else {
        return Ok(None);
    };
    let version = Version::first(opening.estimates.first().frame);
    let record = Record {
        version,
        owner: owner.clone(),
        opening,
        state: stored,
        lives: state.registry.first_lease(),
    };
    match store.calls.create(id, &record).await {
        Ok(Reply::Done(_)) => Ok(Some(version)),
        Ok(_) => Err(InsertError::Taken.into()),
        Err(away) => Err(away.into()),
    }
}

async fn start(
    state: &AppState,
    queue: QueuePermit,
    upload: Upload<CreateSettings>,
) -> Result<SessionState, Problem> {
    let settings = upload.settings;
    let first = FirstFrame {
        boxes: boxes_of(settings.r#box, settings.boxes.as_ref())?,
        preset: settings.preset,
        seed: settings.seed,
        params: settings.params,
    };
    let (worker, queue) = (
        state.clone(),
        queue.for_frames(first.boxes.as_slice().len()),
    );
    let start = move |meter: &mut WorkMeter| first.begin(&worker, &upload.files[0], meter);
    work::run(state, queue, start).await
}

async fn restore(
    state: &AppState,
    queue: QueuePermit,
    upload: Upload<CreateSettings>,
) -> Result<SessionState, Problem> {
    let allowed = CreateSettings {
        verbose: upload.settings.verbose,
        ..CreateSettings::default()
    };
    if upload.settings != allowed {
        let detail = "A snapshot holds the box and the parameters; leave out all settings.";
        return Err(Problem::malformed(detail));
    }
    let (keys, max_recent) = (state.access.snapshots.clone(), state.config.max_frames);
    let restore =
        move |_: &mut WorkMeter| Ok(SessionState::restore(&upload.files[0], &keys, max_recent)?);
    work::run(state, queue, restore).await
}
