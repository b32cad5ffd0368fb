//! `POST /sessions/{id}/token`: a token with which a web page may use this session, and nothing else.

use crate::http::extract::caller::Caller;
use crate::http::extract::caller::SessionPath;
use crate::http::extract::query::QuerySettings;
use crate::http::problems::problem::Problem;
use crate::http::respond::body::Json;
use crate::http::state::AppState;
use axum::extract::State;
use bagtrack_access::SessionToken;
use bagtrack_api::{self as api, requests::TokenSettings};
use std::time::Duration;

const DEFAULT_SECONDS: u32 = 3600;
const MAX_SECONDS: u32 = 86_400;

/// Make a session token
///
/// A web page should not hold an API key. Whoever has one opens a session and gives the page a token for it: the page
/// may then send frames, read, correct, copy and end this session, and do nothing else.
#[utoipa::path(
    post, path = "/sessions/{id}/token", tag = "sessions", operation_id = "createToken",
    params(
        ("id" = Uuid, Path, description = "The session's id"),
        TokenSettings,
    ),
    responses((status = 200, description = "The token", body = api::SessionToken))
)]
pub async fn create(
    State(state): State<AppState>,
    QuerySettings(settings): QuerySettings<TokenSettings>,
    caller: Caller,
    path: SessionPath,
) -> Result<Json<api::SessionToken>, Problem> {
    let seconds = seconds(&settings)?;
    caller.require_key()?;
    let session = path.find(&state).await?;
    let expires = state.now() + Duration::from_secs(seconds.into());
    let token = state.access.tokens.sign(&SessionToken {
        session: session.name(),
        owner: session.owner().clone(),
        key: caller.credential().key,
        expires,
    });
    Ok(Json(api::SessionToken {
        token,
        expires_at: humantime::format_rfc3339_seconds(expires).to_string(),
    }))
}

fn seconds(settings: &TokenSettings) -> Result<u32, Problem> {
    match settings.seconds.unwrap_or(DEFAULT_SECONDS) {
        seconds @ 1..=MAX_SECONDS => Ok(seconds),
        _ => Err(Problem::malformed(format!(
            "`seconds` must be a whole number from 1 to {MAX_SECONDS}."
        ))),
    }
}
