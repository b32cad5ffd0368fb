//! `GET /sessions/{id}/snapshot`: a session as bytes, to be carried elsewhere.

use super::openapi;
use super::problem::Problem;
use super::problem_kind::Kind;
use super::session_path::SessionPath;
use super::state::AppState;
use super::upload;
use super::work;
use axum::extract::State;
use axum::http::Uri;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};

/// The media type of session snapshots.
pub const MEDIA_TYPE: &str = "application/vnd.bagtrack.snapshot";

struct Problems;

impl utoipa::IntoResponses for Problems {
    fn responses()
    -> std::collections::BTreeMap<String, utoipa::openapi::RefOr<utoipa::openapi::Response>> {
        let own = &[
            Kind::MalformedRequest,
            Kind::SessionNotFound,
            Kind::SessionBusy,
            Kind::QueueFull,
            Kind::WorkTimeout,
        ];
        openapi::problems(&[openapi::ALWAYS, own])
    }
}

/// Take a snapshot
///
/// The bytes hold the whole session. Post them to `/sessions`, here or at another instance of the same version, to
/// go on from there under a new id; this session lives on.
///
/// `curl -o s.snapshot http://localhost:8080/sessions/$ID/snapshot && curl --data-binary @s.snapshot http://other:8080/sessions`
#[utoipa::path(
    get, path = "/sessions/{id}/snapshot", tag = "sessions", operation_id = "getSnapshot",
    params(("id" = Uuid, Path, description = "The session's id")),
    responses(
        (status = 200, description = "The session as bytes", body = Vec<u8>, content_type = "application/vnd.bagtrack.snapshot"),
        Problems
    )
)]
pub async fn get(
    State(state): State<AppState>,
    path: SessionPath,
    uri: Uri,
) -> Result<Response, Problem> {
    upload::NOTHING.query(&uri)?;
    let session = path.find(&state)?;
    let queue = state
        .admission
        .enter(0)
        .map_err(|_| Problem::queue_full())?;
    let place = session.enter().map_err(|_| Problem::session_busy())?;
    let take = |locked: &mut crate::sessions::Locked| Ok(locked.state().snapshot());
    let bytes = work::on_session(&state, place, queue, false, take).await?;
    Ok(([(CONTENT_TYPE, MEDIA_TYPE)], bytes).into_response())
}
