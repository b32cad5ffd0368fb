//! `GET /sessions/{id}/snapshot`: a session as bytes, to go on elsewhere.

use super::openapi::problem_responses::{self, problem_responses};
use super::problems::kind::Kind;
use super::problems::problem::Problem;
use super::session_path::SessionPath;
use super::state::AppState;
use super::upload::texts::refuse_query;
use super::work;
use crate::sessions::LockedSession;
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
            Kind::SessionBusy,
            Kind::QueueFull,
            Kind::WorkTimeout,
        ];
        problem_responses(&[problem_responses::ALWAYS, problem_responses::SESSION, own])
    }
}

/// Take a snapshot
///
/// The bytes hold the whole session. Post them to `/sessions`, here or at another instance of the same version that has
/// the same secret (`BAGTRACK_SNAPSHOT_KEYS`), to go on from there under a new id; this session lives on as long as it
/// would have done.
///
/// `curl -o s.snapshot http://localhost:8080/sessions/$ID/snapshot &&
/// curl --data-binary @s.snapshot http://other:8080/sessions`
#[utoipa::path(
    get, path = "/sessions/{id}/snapshot", tag = "sessions", operation_id = "getSnapshot",
    params(("id" = Uuid, Path, description = "The session's id")),
    responses(
        (
            status = 200, description = "The session as bytes", body = Vec<u8>,
            content_type = "application/vnd.bagtrack.snapshot"
        ),
        Problems
    )
)]
pub async fn get(
    State(state): State<AppState>,
    path: SessionPath,
    uri: Uri,
) -> Result<Response, Problem> {
    refuse_query(&uri)?;
    let session = path.find(&state)?;
    let queue = state.admission.enter(0)?;
    let permit = session.visit()?;
    let keys = state.access.snapshots.clone();
    let take = move |locked: &mut LockedSession| Ok(locked.state().snapshot(&keys));
    let bytes = work::on_session(&state, permit, queue, take).await?;
    Ok(([(CONTENT_TYPE, MEDIA_TYPE)], bytes).into_response())
}
