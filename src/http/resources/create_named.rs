//! `PUT /sessions/{id}`: opens a session under an id that the client has made.

use super::create::{CreateForm, CreateJson};
use super::create_request::{CreateRequest, CreateSettings};
use crate::http::openapi::example_frames;
use crate::http::openapi::problem_responses::{self, operation_problems};
use crate::http::openapi::request_bodies::BinaryBody;
use crate::http::problems::kind::Kind;
use crate::http::problems::problem::Problem;
use crate::http::respond::created_session::{CreatedSession, created};
use crate::http::state::AppState;
use axum::extract::State;
use axum::response::Response;

operation_problems!(
    Problems,
    problem_responses::UPLOAD,
    &[
        Kind::Unauthorized,
        Kind::Forbidden,
        Kind::MissingBox,
        Kind::InvalidBox,
        Kind::InvalidParameter,
        Kind::InvalidSnapshot,
        Kind::SessionExists,
        Kind::TooManySessions,
        Kind::NotReady,
        Kind::StoreUnavailable,
    ]
);

/// Open a session under an id of your own
///
/// Takes what `POST /sessions` takes. Make a random UUID, a new one for each session. The same request gets the same
/// answer as long as the session lives, so it can be sent again; another request for the same id answers
/// `session-exists`. Every request for the session has the id in its path, this one too, so a load balancer can route
/// by a hash of the path.
#[utoipa::path(
    put, path = "/sessions/{id}", tag = "sessions", operation_id = "putSession",
    params(
        ("id" = Uuid, Path, description = "The id that the session gets: a UUID"),
        CreateSettings,
    ),
    request_body(
        description = "The first frame as a raw body (JPEG, PNG or WebP), as a form, or as JSON with base64; or a snapshot.",
        content(
            (BinaryBody = "application/octet-stream"),
            (CreateForm = "multipart/form-data"),
            (
                CreateJson = "application/json",
                example = json!({
                    "frame": example_frames::first(),
                    "box": {"x": 10, "y": 20, "width": 30, "height": 40},
                    "seed": 7
                })
            ),
            (BinaryBody = "application/vnd.bagtrack.snapshot"),
        )
    ),
    responses(
        (
            status = 201, description = "The session is open", body = CreatedSession,
            headers(
                ("Location" = String, description = "The session's path"),
                ("Replayed" = bool, description = "`true` where this answer was given before")
            )
        ),
        Problems
    )
)]
pub async fn put(
    State(state): State<AppState>,
    request: CreateRequest,
) -> Result<Response, Problem> {
    let is_verbose = request.is_verbose();
    let opened = state.service.open(request.into_act()?).await?;
    Ok(created(&opened, is_verbose))
}
