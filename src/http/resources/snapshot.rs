//! `GET /sessions/{id}/snapshot`: a session as bytes, to go on elsewhere.

use crate::http::extract::admitted::ReadRequest;
use crate::http::extract::query::NoQuery;
use crate::http::problems::problem::Problem;
use crate::http::respond::body::{ChargedBody, charged_body};
use crate::http::state::AppState;
use axum::extract::State;
use bagtrack_api::media_types::SNAPSHOT;
use bagtrack_api::requests::BinaryBody;

/// Take a snapshot
///
/// The bytes hold the whole session. Post them to `/sessions`, here or at another instance that has the same secret
/// (`BAGTRACK_SNAPSHOT_KEYS`) and reads their format, to go on from there under a new id; this session lives on as long
/// as it would have done.
///
/// `curl -o s.snapshot http://localhost:8080/sessions/$ID/snapshot &&
/// curl --data-binary @s.snapshot http://other:8080/sessions`
#[utoipa::path(
    get, path = "/sessions/{id}/snapshot", tag = "sessions", operation_id = "getSnapshot",
    params(("id" = Uuid, Path, description = "The session's id")),
    responses(
        (
            status = 200, description = "The session as bytes", body = BinaryBody,
            content_type = "application/vnd.bagtrack.snapshot"
        )
    )
)]
pub async fn get(
    State(state): State<AppState>,
    request: ReadRequest<NoQuery>,
) -> Result<ChargedBody, Problem> {
    let (permit, queue, mut charge) = (request.permit, request.queue, request.charge);
    let snapshot = state.service.snapshot(permit, queue).await?;
    charge.grow(snapshot.len())?;
    Ok(charged_body(SNAPSHOT, snapshot, charge))
}
