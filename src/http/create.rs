//! `POST /sessions`: a first frame and a box, or a snapshot, open a session.

use super::create_request::{CreateRequest, CreateSettings, check_room};
use super::idempotency::StoredAnswer;
use super::openapi::param_limits;
use super::openapi::problem_responses::{self, operation_problems};
use super::openapi::request_bodies::{BinaryBody, FormBody, JsonBody};
use super::opening::{CreatedSession, Opened, open};
use super::problems::kind::Kind;
use super::problems::problem::Problem;
use super::state::AppState;
use axum::extract::State;
use axum::response::Response;
use tokio::time::timeout;

type CreateForm = FormBody<CreateSettings>;
type CreateJson = JsonBody<CreateSettings>;

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
        description = "The first frame in one of three forms, or a snapshot.",
        content(
            (BinaryBody = "image/jpeg"), (BinaryBody = "image/png"), (BinaryBody = "image/webp"),
            (CreateForm = "multipart/form-data"),
            (
                CreateJson = "application/json",
                example = json!({
                    "frame": "/9j/4AAQSkZJRg…",
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
            ),
            links(
                ("getSession" = (operation_id = "getSession", parameters(("id" = "$response.body#/id")))),
                ("postFrames" = (operation_id = "postFrames", parameters(("id" = "$response.body#/id")))),
                ("putTarget" = (operation_id = "putTarget", parameters(("id" = "$response.body#/id")))),
                ("getSnapshot" = (operation_id = "getSnapshot", parameters(("id" = "$response.body#/id")))),
                ("createToken" = (operation_id = "createToken", parameters(("id" = "$response.body#/id")))),
                ("deleteSession" = (operation_id = "deleteSession", parameters(("id" = "$response.body#/id"))))
            )
        ),
        Problems
    )
)]
pub async fn create(
    State(state): State<AppState>,
    request: CreateRequest,
) -> Result<Response, Problem> {
    let Some(key) = request.key.clone() else {
        return Ok(open(&state, request).await?.response(false));
    };
    let digest = request.digest();
    let is_live = |id| state.registry.is_live(id);
    let entry = state.opened.entry(request.caller.owner(), key, is_live);
    // Another request with this key may be about to open the session.
    let locked = timeout(state.config.work_timeout, entry.lock_owned());
    let mut stored = locked.await.map_err(|_| Problem::work_timeout())?;
    let earlier = stored.as_ref();
    if let Some(answer) = earlier.filter(|answer| is_live(answer.session)) {
        return match answer.request == digest {
            true => Ok(Opened::from(answer).response(true)),
            false => Err(Problem::idempotency_key_reused()),
        };
    }
    check_room(&state)?;
    let opened = open(&state, request).await?;
    *stored = Some(StoredAnswer {
        request: digest,
        session: opened.id,
        body: opened.body.clone(),
    });
    Ok(opened.response(false))
}
