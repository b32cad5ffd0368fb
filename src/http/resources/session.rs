//! `GET` and `DELETE /sessions/{id}`.

use crate::http::extract::caller::SessionPath;
use crate::http::extract::query::NoQuery;
use crate::http::problems::problem::Problem;
use crate::http::respond::answer::answer;
use crate::http::respond::body::Json;
use crate::http::state::AppState;
use axum::extract::State;
use axum::http::StatusCode;
use bagtrack_api::SessionView;
use bagtrack_api::requests::public_params;

/// See where a session stands
///
/// Answers at once, also while a frame is being tracked.
#[utoipa::path(
    get, path = "/sessions/{id}", tag = "sessions", operation_id = "getSession",
    params(("id" = Uuid, Path, description = "The session's id")),
    responses((status = 200, description = "The session", body = SessionView))
)]
pub async fn get(
    State(state): State<AppState>,
    _: NoQuery,
    path: SessionPath,
) -> Result<Json<SessionView>, Problem> {
    let session = path.find_newest(&state).await?;
    let latest = session.latest();
    Ok(Json(SessionView {
        id: session.id(),
        frames: latest.first().frame + 1,
        answer: answer(&latest, None),
        image: session.source_size().into(),
        parameters: public_params(session.params()),
        expires_at: state.expires_at(&session),
    }))
}

/// End a session
///
/// A frame that is being tracked still gets its answer; frames that wait do not.
#[utoipa::path(
    delete, path = "/sessions/{id}", tag = "sessions", operation_id = "deleteSession",
    params(("id" = Uuid, Path, description = "The session's id")),
    responses((status = 204, description = "The session has ended"))
)]
pub async fn delete(
    State(state): State<AppState>,
    _: NoQuery,
    path: SessionPath,
) -> Result<StatusCode, Problem> {
    path.end(&state).await?;
    Ok(StatusCode::NO_CONTENT)
}
