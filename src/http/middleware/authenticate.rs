//! Finds out who makes a request, from its header `Authorization: Bearer …`.
//!
//! A web page cannot set that header when it opens a WebSocket. It offers its session token as a protocol instead
//! (`Sec-WebSocket-Protocol`). An API key is not taken there: it has no business in a page.

use crate::http::extract::caller::Caller;
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::extract::Request;
use axum::http::header::{AUTHORIZATION, SEC_WEBSOCKET_PROTOCOL, WWW_AUTHENTICATE};
use axum::http::{HeaderMap, HeaderValue};
use axum::response::{IntoResponse, Response};
use bagtrack_access::{Credential, NotIdentified, TOKEN_PREFIX};
use bagtrack_api::ProblemKind as Kind;
use bagtrack_quotas::Client;

/// `WWW-Authenticate` where no valid key or session token was sent, and where a JWT is refused (RFC 6750, section 3).
const CHALLENGE: HeaderValue = HeaderValue::from_static("Bearer realm=\"bagtrack\"");
#[cfg(feature = "jwt")]
const INVALID_TOKEN: HeaderValue =
    HeaderValue::from_static("Bearer realm=\"bagtrack\", error=\"invalid_token\"");

/// Puts the [`Caller`] into the extensions of the request.
///
/// # Errors
/// The request has no valid key or token: the error is the answer 401.
pub async fn authenticate(state: &AppState, request: &mut Request) -> Result<(), Response> {
    match caller(state, request.headers()).await {
        Ok(caller) => {
            // The quotas of a key hold for all its requests, whatever their addresses. A page has a part of them only.
            if let Some(name) = caller.owner().name() {
                let client = match caller.page_of() {
                    Some(session) => Client::Page(name.into(), session),
                    None => Client::Key(name.into()),
                };
                request.extensions_mut().insert(client);
            }
            request.extensions_mut().insert(caller);
            Ok(())
        }
        Err(refused) => Err(unauthorized(&refused, request.headers())),
    }
}

/// Asks for the key of the metrics, where the settings have one. Otherwise does as [`authenticate`].
///
/// # Errors
/// The request has no valid key or token: the error is the answer 401.
pub async fn authenticate_metrics(state: &AppState, request: &mut Request) -> Result<(), Response> {
    let Some(key) = &state.config.access.metrics_key else {
        return authenticate(state, request).await;
    };
    // Digests are compared in constant time.
    let digest = |text: &str| blake3::hash(text.as_bytes());
    let presented = bearer(request.headers()).map(digest);
    if presented != Some(digest(key.text())) {
        return Err(unauthorized(&NotIdentified::Key, request.headers()));
    }
    let reader = Caller::with_key(Credential::default());
    request.extensions_mut().insert(reader);
    Ok(())
}

fn unauthorized(refused: &NotIdentified, headers: &HeaderMap) -> Response {
    let (problem, challenge) = match refused {
        NotIdentified::Key => (not_identified(headers), CHALLENGE),
        #[cfg(feature = "jwt")]
        NotIdentified::Token(error) => (Problem::invalid_token(error), INVALID_TOKEN),
    };
    let mut response = problem.into_response();
    response.headers_mut().insert(WWW_AUTHENTICATE, challenge);
    response
}

/// The problem of a request whose key or token is missing or not valid.
fn not_identified(headers: &HeaderMap) -> Problem {
    let presented = bearer(headers).or_else(|| offered_token(headers));
    let detail = match presented {
        Some(text) if text.starts_with(TOKEN_PREFIX) => {
            "The session token has ended, or its key has, or it is from before a restart: they stay good with \
                `--snapshot-keys`. Make a new one: `POST /sessions/{id}/token`."
        }
        Some(text) if text.contains(':') => {
            "The key is not known here. Of a line `name:key` of the service's keys, send the part after the colon."
        }
        Some(_) => "The key is not known here (`/metrics` may have its own, `--metrics-key`).",
        None if headers.contains_key(AUTHORIZATION) => {
            "The header must be `Authorization: Bearer …`, once, with an API key or a session token."
        }
        None => return Problem::unauthorized(),
    };
    Problem::new(Kind::Unauthorized, detail)
}

async fn caller(state: &AppState, headers: &HeaderMap) -> Result<Caller, NotIdentified> {
    let (access, now) = (&state.access, state.now());
    let presented = bearer(headers).or_else(|| offered_token(headers));
    if let Some(text) = presented.filter(|text| text.starts_with(TOKEN_PREFIX)) {
        let (session, credential) = access.session_token(text, now).ok_or(NotIdentified::Key)?;
        return Ok(Caller::with_token(session, credential));
    }
    if !access.is_needed() {
        return Ok(Caller::with_key(Credential::default()));
    }
    let presented = presented.ok_or(NotIdentified::Key)?;
    access.identify(presented, now).await.map(Caller::with_key)
}

/// The key or token of the only `Authorization` header.
fn bearer(headers: &HeaderMap) -> Option<&str> {
    let mut values = headers.get_all(AUTHORIZATION).iter();
    let (Some(value), None) = (values.next(), values.next()) else {
        return None;
    };
    let (scheme, text) = value.to_str().ok()?.split_once(' ')?;
    let is_bearer = scheme.eq_ignore_ascii_case("bearer");
    is_bearer.then(|| text.trim())
}

/// The session token among the protocols that a page offers.
fn offered_token(headers: &HeaderMap) -> Option<&str> {
    if headers.contains_key(AUTHORIZATION) {
        return None;
    }
    let offers = headers.get_all(SEC_WEBSOCKET_PROTOCOL).iter();
    let offers = offers
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','));
    offers
        .map(str::trim)
        .find(|offer| offer.starts_with(TOKEN_PREFIX))
}
