//! What went wrong with a request: one small constructor for each kind of problem that a handler finds itself.

use super::kind::Kind;
use axum::response::{IntoResponse, Response};
use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

/// What went wrong with a request.
#[derive(Debug, Clone)]
pub struct Problem {
    kind: Kind,
    detail: String,
    /// The number of the next frame, where a frame number was wrong.
    expected_frame: Option<u64>,
    /// Which frame of the request is meant, counted from 0.
    index: Option<usize>,
    /// When trying again makes sense, where it is known better than by the kind.
    retry_after: Option<Duration>,
    /// The cause, for the log only.
    cause: Option<Arc<dyn Error + Send + Sync>>,
}

impl Problem {
    /// A problem of this kind.
    pub fn new(kind: Kind, detail: impl Into<String>) -> Self {
        Self {
            kind,
            detail: detail.into(),
            expected_frame: None,
            index: None,
            retry_after: None,
            cause: None,
        }
    }

    /// The request cannot be read; `detail` says why and what would do.
    pub fn malformed(detail: impl Into<String>) -> Self {
        Self::new(Kind::MalformedRequest, detail)
    }

    /// No frame came.
    pub fn missing_frame() -> Self {
        let detail = "Send the image as the body, as the multipart part `frame`, or as base64 in the JSON \
            field `frame`.";
        Self::new(Kind::MissingFrame, detail)
    }

    /// No box came.
    pub fn missing_box() -> Self {
        let detail = "Send the target's box in the pixels of the frame: `box=x,y,width,height` in the query \
            or as a field; for several targets `boxes=x,y,width,height;x,y,width,height`.";
        Self::new(Kind::MissingBox, detail)
    }

    /// It is not told which target is meant, or there is none of this number.
    pub fn which_target(count: usize) -> Self {
        let detail = match count {
            1 => "This session has one target; leave out `target`, or say 0.".to_owned(),
            _ => format!(
                "This session has {count} targets; say which one is meant: `target` from 0 to {}.",
                count - 1
            ),
        };
        Self::malformed(detail)
    }

    /// No route has this path.
    pub fn route_not_found() -> Self {
        Self::new(Kind::RouteNotFound, "See /docs for the paths there are.")
    }

    /// No route has this path.
    pub fn no_route(path: &str) -> Self {
        match path.trim_end_matches('/') {
            "" => Self::route_not_found(),
            _ if !path.ends_with('/') => Self::route_not_found(),
            shorter => {
                let shorter: String = shorter.chars().take(100).collect();
                let detail = format!(
                    "Leave out the slash at the end: `{shorter}`. See /docs for the paths there are."
                );
                Self::new(Kind::RouteNotFound, detail)
            }
        }
    }

    /// The request has no key, or none that is valid.
    pub fn unauthorized() -> Self {
        let detail =
            "Send an API key, or a session token that has not ended: `Authorization: Bearer …`.";
        Self::new(Kind::Unauthorized, detail)
    }

    /// The request needs an API key, and came with a session token.
    pub fn forbidden() -> Self {
        let detail =
            "Use an API key: a session token is good for what is below its own session only.";
        Self::new(Kind::Forbidden, detail)
    }

    /// A browser sent the request for a page of another origin.
    pub fn origin_not_allowed() -> Self {
        let detail = "Start the service with the origin of the page in --cors-origins (BAGTRACK_CORS_ORIGINS).";
        Self::new(Kind::OriginNotAllowed, detail)
    }

    /// The request names another host.
    pub fn host_not_allowed() -> Self {
        let detail =
            "Start the service with this host in --allowed-hosts (BAGTRACK_ALLOWED_HOSTS).";
        Self::new(Kind::HostNotAllowed, detail)
    }

    /// No live session of the client has this id.
    pub fn session_not_found() -> Self {
        let detail = "The session was never opened here with this key, or was deleted; open a new one with POST \
            /sessions.";
        Self::new(Kind::SessionNotFound, detail)
    }

    /// The session was not used for too long.
    pub fn session_expired() -> Self {
        let detail = "No frame came in time; `expires_at` tells how long a session waits. Open a new one with POST \
            /sessions.";
        Self::new(Kind::SessionExpired, detail)
    }

    /// The idempotency key came with another request before.
    pub fn idempotency_key_reused() -> Self {
        let detail =
            "Send the same frame and settings as the first time, or a new `Idempotency-Key`.";
        Self::new(Kind::IdempotencyKeyReused, detail)
    }

    /// A live session that another request opened has the id.
    pub fn session_exists() -> Self {
        let detail = "A live session has this id, and another frame, other settings or another key opened it. Make a new \
            id.";
        Self::new(Kind::SessionExists, detail)
    }

    /// The route has other methods.
    pub fn method_not_allowed() -> Self {
        Self::new(
            Kind::MethodNotAllowed,
            "The header `Allow` lists the methods there are.",
        )
    }

    /// The frame has no number, and came while another request was at the session.
    pub fn not_in_order() -> Self {
        let detail = "Another request with frames was at this session. Number the frames (`?frame=N`), or wait for each \
            answer. This one was not tracked.";
        Self::new(Kind::NotInOrder, detail)
    }

    /// A parameter is unknown, has the wrong type or is out of its range.
    pub fn invalid_parameter(detail: impl Into<String>) -> Self {
        Self::new(Kind::InvalidParameter, detail)
    }

    /// The work took too long.
    pub fn work_timeout() -> Self {
        let detail = "Try again after the time in `Retry-After`. A frame sent with its number (`?frame=N`) is \
            never tracked twice.";
        Self::new(Kind::WorkTimeout, detail)
    }

    /// The store has no record of a session whose time is not over.
    pub fn session_lost() -> Self {
        let detail = "The store has lost this session. Open a new one with POST /sessions, from your last snapshot, or from \
            a frame and a box.";
        Self::new(Kind::SessionNotFound, detail)
    }

    /// The service is about to end.
    pub fn not_ready() -> Self {
        let detail = "The service is about to end. Open sessions at another instance.";
        Self::new(Kind::NotReady, detail)
    }

    /// Something of the service is full.
    pub fn saturated(what: &str) -> Self {
        let detail = format!("{what} Send requests to another instance.");
        Self::new(Kind::NotReady, detail)
    }

    /// The service failed.
    pub fn internal(cause: Arc<dyn Error + Send + Sync>) -> Self {
        Self::panicked().caused_by(cause)
    }

    /// The service failed, and the log already has the cause.
    pub fn panicked() -> Self {
        let detail = "The fault is the service's. The log has the cause under this request id.";
        Self::new(Kind::Internal, detail)
    }

    /// Says which of `count` frames is meant.
    pub fn of_frame(mut self, index: usize, count: usize) -> Self {
        if count > 1 {
            self.detail = format!(
                "Frame {} of {count} in this request: {} None of them was tracked.",
                index + 1,
                self.detail
            );
            self.index = Some(index);
        }
        self
    }

    /// Says which of `count` targets is meant.
    pub fn of_target(mut self, target: usize, count: usize) -> Self {
        self.detail = format!(
            "Target {target} of {count}, counted from 0: {}",
            self.detail
        );
        self
    }

    pub(in crate::http) fn caused_by(mut self, cause: Arc<dyn Error + Send + Sync>) -> Self {
        self.cause = Some(cause);
        self
    }

    /// The same of another kind.
    pub(in crate::http) fn with_kind(self, kind: Kind) -> Self {
        Self { kind, ..self }
    }

    pub(super) fn expecting_frame(mut self, number: u64) -> Self {
        self.expected_frame = Some(number);
        self
    }

    /// Says when trying again makes sense.
    pub fn retry_after(mut self, wait: Duration) -> Self {
        self.retry_after = Some(wait);
        self
    }

    /// Seconds after which trying again makes sense, where it does; at least 1.
    pub fn retry_seconds(&self) -> Option<u32> {
        let known = self
            .retry_after
            .map(|wait| wait.as_secs_f64().ceil() as u32);
        known
            .map(|seconds| seconds.max(1))
            .or_else(|| self.kind.retry_after())
    }

    /// Its kind.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// What happened this time, and what to do.
    pub fn detail(&self) -> &str {
        &self.detail
    }

    /// The number of the next frame, where a frame number was wrong.
    pub fn expected_frame(&self) -> Option<u64> {
        self.expected_frame
    }

    /// Which frame of the request is meant, counted from 0.
    pub fn index(&self) -> Option<usize> {
        self.index
    }

    /// The cause and its causes, for the log.
    pub fn cause(&self) -> Option<String> {
        let mut error: &dyn Error = self.cause.as_deref()?;
        let mut text = error.to_string();
        while let Some(source) = error.source() {
            text = format!("{text}: {source}");
            error = source;
        }
        Some(text)
    }
}

impl IntoResponse for Problem {
    /// The status alone: an outer layer writes the document, since it knows the request.
    fn into_response(self) -> Response {
        let mut response = self.kind.status().into_response();
        response.extensions_mut().insert(self);
        response
    }
}
