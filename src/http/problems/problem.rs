//! What went wrong with a request: one small constructor for each kind of problem that a handler finds itself.

use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use bagtrack_api::requests::{FrameCount, Settings};
use bagtrack_api::{ProblemDocument, ProblemKind as Kind};
use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

/// What a refused request did: the last sentence of the detail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    NothingChanged,
    SessionUnchanged,
    NoFrameTracked,
    /// The frames that got their lines before the refusal count.
    LinesCount,
}

impl Effect {
    fn sentence(self) -> &'static str {
        match self {
            Self::NothingChanged => "Nothing was changed.",
            Self::SessionUnchanged => "The session is unchanged.",
            Self::NoFrameTracked => "No frame of this request was tracked.",
            Self::LinesCount => "The lines before this one count.",
        }
    }
}

/// What went wrong with a request.
#[derive(Debug, Clone)]
pub struct Problem {
    kind: Kind,
    detail: String,
    effect: Option<Effect>,
    /// The number of the next frame, where a frame number was wrong.
    expected_frame: Option<u64>,
    /// Which frame of the request is meant, counted from 0.
    index: Option<usize>,
    /// After how long trying again makes sense; `None` for the default of the kind.
    retry_after: Option<Duration>,
    /// The cause, for the log only.
    cause: Option<Arc<dyn Error + Send + Sync>>,
}

impl Problem {
    pub fn new(kind: Kind, detail: impl Into<String>) -> Self {
        Self {
            kind,
            detail: detail.into(),
            effect: None,
            expected_frame: None,
            index: None,
            retry_after: None,
            cause: None,
        }
    }

    /// The request cannot be read. `detail` says why, and what to send instead.
    pub fn malformed(detail: impl Into<String>) -> Self {
        Self::new(Kind::MalformedRequest, detail)
    }

    /// The request does not say which of the session's `count` targets is meant, or names one that there is not.
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

    /// A parameter is unknown, has the wrong type or is out of its range.
    pub fn invalid_parameter(detail: impl Into<String>) -> Self {
        Self::new(Kind::InvalidParameter, detail)
    }

    /// The token of an identity provider is not taken.
    #[cfg(feature = "jwt")]
    pub fn invalid_token(error: &bagtrack_access::TokenError) -> Self {
        let detail = format!(
            "The bearer token is not taken: {error}. Send one of the service's issuer, or an API key."
        );
        Self::new(Kind::Unauthorized, detail)
    }

    /// A resource of the service is full. `what` is a sentence that names it.
    pub fn saturated(what: &str) -> Self {
        let detail = format!("{what} Send requests to another instance.");
        Self::new(Kind::NotReady, detail)
    }

    pub fn internal(cause: Arc<dyn Error + Send + Sync>) -> Self {
        Self::panicked().caused_by(cause)
    }

    /// The body has more bytes than it may.
    pub fn body_too_large(limit: usize) -> Self {
        let detail = format!(
            "A body may have at most {limit} bytes here (`--max-body-bytes`). Send smaller or fewer frames, or a \
                smaller video: `ffmpeg -i VIDEO -vf scale=1280:-2 clip.mp4` makes one."
        );
        Self::new(Kind::BodyTooLarge, detail)
    }

    /// The frames of the request have more pixels than one request may have.
    pub fn too_many_pixels(pixels: u64, limit: u64) -> Self {
        let detail = format!(
            "The frames of this request have {pixels} pixels together; at most {limit} are taken. Send fewer frames \
             in a request."
        );
        Self::new(Kind::RequestTooCostly, detail).with_effect(Effect::NoFrameTracked)
    }

    /// The request has more frames than a call with these settings takes: one, or `limit`.
    pub fn too_many_frames<S: Settings>(limit: usize) -> Self {
        let detail = match (S::FRAMES, S::TAKES_VIDEO) {
            (FrameCount::Several, _) => format!(
                "A request may have at most {limit} frames here (`--max-frames`); send the rest in another one."
            ),
            (FrameCount::One, true) => {
                "This call takes one video; send each of the others in a request of its own."
                    .to_owned()
            }
            (FrameCount::One, false) => {
                "This call takes one frame: send the first one alone, then those after it to \
                    `POST /sessions/{id}/frames`."
                    .to_owned()
            }
        };
        Self::new(Kind::TooManyFrames, detail)
    }

    pub fn and(mut self, more: &str) -> Self {
        self.detail = format!("{} {more}", self.detail);
        self
    }

    /// Says what the refused request did, or left as it was.
    pub fn with_effect(self, effect: Effect) -> Self {
        Self {
            effect: Some(effect),
            ..self
        }
    }

    /// Says which of `count` frames is at fault, counted from 0, where none of them is tracked.
    pub fn of_frame(mut self, index: usize, count: usize) -> Self {
        if count > 1 {
            self.detail = format!(
                "Frame {} of {count} in this request: {}",
                index + 1,
                self.detail
            );
            self.effect = Some(Effect::NoFrameTracked);
            self.index = Some(index);
        }
        self
    }

    /// Says which file of the request is at fault, counted from 0, where those before it count.
    pub fn at_frame(self, index: usize) -> Self {
        Self {
            index: Some(index),
            ..self
        }
    }

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

    pub(super) fn expecting_frame(mut self, number: u64) -> Self {
        self.expected_frame = Some(number);
        self
    }

    /// Says when trying again makes sense.
    pub fn retry_after(mut self, wait: Duration) -> Self {
        self.retry_after = Some(wait);
        self
    }

    /// Seconds after which trying again makes sense, at least 1; `None` where it never does.
    pub fn retry_seconds(&self) -> Option<u32> {
        let known = self
            .retry_after
            .map(|wait| wait.as_secs_f64().ceil() as u32);
        known
            .map(|seconds| seconds.max(1))
            .or_else(|| self.kind.retry_after())
    }

    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// The HTTP status of the answer.
    pub fn status(&self) -> StatusCode {
        StatusCode::from_u16(self.kind.status()).expect("the catalogue holds valid status codes")
    }

    /// The document of the problem, for the request to this path with this id, of a service below a base path.
    pub fn document(
        &self,
        base_path: &str,
        instance: String,
        request_id: String,
    ) -> ProblemDocument {
        let effect = self.effect.map(Effect::sentence);
        let sentences = [self.detail.as_str()].into_iter().chain(effect);
        ProblemDocument {
            type_uri: self.kind.uri(base_path),
            title: self.kind.title().to_owned(),
            status: self.kind.status(),
            detail: sentences.collect::<Vec<_>>().join(" "),
            instance,
            request_id,
            expected_frame: self.expected_frame,
            index: self.index,
            retry_after: None,
        }
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

/// Makes the constructors of problems whose text is always the same.
macro_rules! fixed {
    ($($name:ident: $kind:ident $detail:literal $($effect:ident)?;)*) => {
        impl Problem {
            $(pub fn $name() -> Self {
                Self::new(Kind::$kind, $detail)$(.with_effect(Effect::$effect))?
            })*
        }
    };
}

fixed! {
    missing_frame: MissingFrame
        "Send the image as the body, as the multipart part `frame`, or as base64 in the JSON field `frame`.";
    missing_box: MissingBox
        "Send the target's box in the pixels of the frame: `box=x,y,width,height` in the query or as a field; for \
            several targets `boxes=x,y,width,height;x,y,width,height`.";
    missing_corrected_box: MissingBox
        "Send where the target is in this frame, in its pixels: `box=x,y,width,height` in the query or as a field. Where \
            the session has several targets, `target=N` says which one.";
    route_not_found: RouteNotFound "See /docs for the paths there are.";
    unauthorized: Unauthorized "Send an API key, or a session token that has not ended: `Authorization: Bearer …`.";
    forbidden: Forbidden "Use an API key: a session token is good for what is below its own session only.";
    origin_not_allowed: OriginNotAllowed
        "Start the service with the origin of the page in --cors-origins (BAGTRACK_CORS_ORIGINS).";
    host_not_allowed: HostNotAllowed "Start the service with this host in --allowed-hosts (BAGTRACK_ALLOWED_HOSTS).";
    session_not_found: SessionNotFound
        "No session of yours has this id (a UUID) here: it was never opened with this key, was deleted, or the service \
            was started again without a store. Open a new one with POST /sessions.";
    session_expired: SessionExpired
        "No frame came in time; `expires_at` tells how long a session waits. Open a new one with POST /sessions.";
    idempotency_key_reused: IdempotencyKeyReused
        "Send the same frame and settings as the first time, or a new `Idempotency-Key`.";
    session_exists: SessionExists
        "A live session has this id, and another frame, other settings or another key opened it. Make a new id.";
    not_in_order: NotInOrder
        "Another request with frames was at this session. Number the frames (`?frame=N`), or wait for each answer. \
            This one was not tracked.";
    work_timeout: WorkTimeout
        "Try again after the time in `Retry-After`. A frame sent with its number (`?frame=N`) is never tracked \
            twice.";
    session_lost: SessionNotFound
        "The store has lost this session. Open a new one with POST /sessions, from your last snapshot, or from a \
            frame and a box.";
    not_ready: NotReady "The service is about to end. Open sessions at another instance.";
    panicked: Internal "The fault is the service's. The log has the cause under this request id.";
    too_many_connections: QuotaExceeded
        "This address has as many connections as one may, all of them busy. Use them again, or try again after the \
            time in `Retry-After`.";
    method_not_allowed: MethodNotAllowed "The header `Allow` lists the methods there are.";
    body_timeout: BodyTimeout "Send the whole body faster, or a smaller frame." SessionUnchanged;
}

impl IntoResponse for Problem {
    /// The status alone: a middleware writes the document, since it knows the request.
    fn into_response(self) -> Response {
        let mut response = self.status().into_response();
        response.extensions_mut().insert(self);
        response
    }
}
