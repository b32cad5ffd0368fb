//! What names a request to its client: the path, as the client knows it, the id, and the idempotency key.
//!
//! The id is the client's `x-request-id` where it can be used, so that a trace can be followed through several
//! services, else a new one.

use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::extract::{FromRequestParts, Request};
use axum::http::header::HeaderName;
use axum::http::request::Parts;
use axum::http::{Extensions, HeaderMap, HeaderValue, Uri};
use bagtrack_api::{ProblemDocument, ProblemKind as Kind};
use bagtrack_sessions::random::new_id;
use std::convert::Infallible;

pub const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");
const MAX_ID_BYTES: usize = 64;

/// The whole path of a request, where a middleware has taken the base path off its URI.
#[derive(Debug, Clone)]
pub struct ClientPath(pub String);

/// The path and the id of a request that has passed the middleware.
#[derive(Debug, Clone)]
pub struct Instance {
    /// The path, as the client knows it.
    pub path: String,
    pub request_id: String,
}

impl Instance {
    pub fn of(request: &Request) -> Self {
        Self::from_head(request.extensions(), request.uri(), request.headers())
    }

    fn from_head(extensions: &Extensions, uri: &Uri, headers: &HeaderMap) -> Self {
        let known = extensions.get::<ClientPath>();
        let id = headers.get(REQUEST_ID);
        let id = id.and_then(|id| id.to_str().ok());
        Self {
            path: known.map_or_else(|| uri.path().to_owned(), |path| path.0.clone()),
            request_id: id.unwrap_or_default().to_owned(),
        }
    }

    /// Counts a problem of the request, writes it to the log with its cause, and returns its document.
    pub fn report(&self, state: &AppState, problem: &Problem) -> ProblemDocument {
        let cause = problem.cause();
        let (kind, cause) = (problem.kind().slug(), cause.as_deref());
        match problem.kind() {
            Kind::Internal => tracing::error!(problem = kind, cause, "refused"),
            _ => tracing::info!(problem = kind, cause, "refused"),
        }
        self.count(state, problem)
    }

    /// Counts a problem, and returns its document.
    pub fn count(&self, state: &AppState, problem: &Problem) -> ProblemDocument {
        state.metrics.problem(problem.kind());
        let (path, id) = (self.path.clone(), self.request_id.clone());
        problem.document(state.config.base_path.as_str(), path, id)
    }
}

impl<S: Sync> FromRequestParts<S> for Instance {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> Result<Self, Infallible> {
        Ok(Self::from_head(
            &parts.extensions,
            &parts.uri,
            &parts.headers,
        ))
    }
}

/// Returns the request id in the headers. Where there is none, or one that is too long or has characters other than
/// ASCII letters, digits and `-_.:`, sets a new one first: ids are logged and sent back.
pub fn set_request_id(headers: &mut HeaderMap) -> HeaderValue {
    let is_usable = |id: &&HeaderValue| {
        let is_allowed = |byte: &u8| byte.is_ascii_alphanumeric() || b"-_.:".contains(byte);
        (1..=MAX_ID_BYTES).contains(&id.len()) && id.as_bytes().iter().all(is_allowed)
    };
    if let Some(id) = headers.get(REQUEST_ID).filter(is_usable) {
        // A clone would keep the bytes of the whole head until the answer.
        return HeaderValue::from_bytes(id.as_bytes()).expect("it is a header's value");
    }
    let id = new_id().to_string();
    let id = HeaderValue::try_from(id).expect("a UUID is visible ASCII");
    headers.insert(REQUEST_ID, id.clone());
    id
}

pub const IDEMPOTENCY_KEY: &str = "idempotency-key";
const MAX_KEY_BYTES: usize = 255;

/// The idempotency key of a request.
///
/// # Errors
/// There is more than one, or it is empty, too long, or not visible ASCII.
pub fn idempotency_key(headers: &HeaderMap) -> Result<Option<String>, Problem> {
    let mut values = headers.get_all(IDEMPOTENCY_KEY).iter();
    let Some(value) = values.next() else {
        return Ok(None);
    };
    let text = value.to_str().unwrap_or("");
    let usable = (1..=MAX_KEY_BYTES).contains(&text.len())
        && text.bytes().all(|byte| byte.is_ascii_graphic());
    match usable && values.next().is_none() {
        true => Ok(Some(text.to_owned())),
        false => Err(Problem::malformed(
            "`Idempotency-Key` must be given once, with 1 to 255 visible ASCII characters.",
        )),
    }
}
