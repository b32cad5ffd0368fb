//! `POST /sessions`: a first frame and a box, or a snapshot, open a session.

use super::create_request::{CreateRequest, CreateSettings};
use crate::http::openapi::problem_responses::{self, operation_problems};
use crate::http::openapi::request_bodies::{BinaryBody, FormBody, JsonBody};
use crate::http::openapi::{example_frames, param_limits};
use crate::http::problems::kind::Kind;
use crate::http::problems::problem::Problem;
use crate::http::respond::created_session::{CreatedSession, created};
use crate::http::state::AppState;
use axum::extract::State;
use axum::response::Response;

/// The form of a request to open a session.
pub type CreateForm = FormBody<CreateSettings>;
/// The JSON of a request to open a session.
pub type CreateJson = JsonBody<CreateSettings>;

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
        Kind::IdempotencyKeyReused,
        Kind::TooManySessions,
        Kind::NotReady,
        Kind::StoreUnavailable,
    ]
);

/// Open a session
#[utoipa::path(
    post, path = "/sessions", tag = "sessions", operation_id = "createSession",
    description = param_limits::create_description(),
    params(
        CreateSettings,
        (
            "Idempotency-Key" = Option<String>, Header, nullable = false, min_length = 1, max_length = 255,
            pattern = "^[!-~]+$",
            description = "A text of your own, a new one for each session: the same request with the same key gets \
                the same answer as long as the session lives, and opens no second one."
        )
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
pub async fn create(
    State(state): State<AppState>,
    request: CreateRequest,
) -> Result<Response, Problem> {
    let is_verbose = request.is_verbose();
    let opened = state.service.open(request.into_act()?).await?;
    Ok(created(&opened, is_verbose))
}
