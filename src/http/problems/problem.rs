//! Errors as problem documents (RFC 9457): one small constructor a kind. What a client reads says what to
//! do; the real cause is kept for the log.

use super::problem_kind::Kind;
use crate::ingest::IngestError;
use crate::sessions::{EnvelopeError, ReplayError};
use crate::tracker::TrackerError;
use axum::Json;
use axum::http::HeaderValue;
use axum::http::header::{CONTENT_TYPE, RETRY_AFTER};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use std::error::Error;
use std::sync::Arc;

/// The media type of problem documents.
pub const MEDIA_TYPE: &str = "application/problem+json";

/// What went wrong with a request.
#[derive(Debug, Clone)]
pub struct Problem {
    kind: Kind,
    detail: String,
    /// The number of the next frame, where a frame number was wrong.
    expected_frame: Option<u64>,
    /// Which frame of the request is meant, counted from 0.
    index: Option<usize>,
    /// The real cause, for the log alone.
    cause: Option<Arc<dyn Error + Send + Sync>>,
}

/// A problem document (RFC 9457).
#[derive(Debug, Serialize, utoipa::ToSchema)]
#[schema(as = Problem)]
pub struct Document {
    /// Names the kind of problem and never changes: `urn:bagtrack:problem:…`.
    #[schema(example = "urn:bagtrack:problem:session-not-found")]
    r#type: String,
    /// The kind of problem in a few words.
    title: &'static str,
    /// The status code of the response.
    #[schema(minimum = 400, maximum = 599)]
    status: u16,
    /// What happened this time, and what to do.
    detail: String,
    /// The path of the request.
    #[schema(example = "/sessions")]
    instance: String,
    /// The id of the request; also in the header `x-request-id`.
    #[schema(example = "1da43888-6f49-40f8-a05c-7bb628ba4f6a")]
    request_id: String,
    /// With a wrong frame number: the number of the next frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    expected_frame: Option<u64>,
    /// Which frame of the request is meant, counted from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    index: Option<usize>,
}

impl Problem {
    fn new(kind: Kind, detail: impl Into<String>) -> Self {
        Self {
            kind,
            detail: detail.into(),
            expected_frame: None,
            index: None,
            cause: None,
        }
    }

    /// The request cannot be read; `detail` says why and what would do.
    pub fn malformed(detail: impl Into<String>) -> Self {
        Self::new(Kind::MalformedRequest, detail)
    }

    /// No frame came.
    pub fn missing_frame() -> Self {
        let detail = "Send the image as the body, as the multipart part `frame`, or as base64 in the JSON field `frame`.";
        Self::new(Kind::MissingFrame, detail)
    }

    /// No box came.
    pub fn missing_box() -> Self {
        let detail = "Send the target's box in the pixels of the frame: `box=x,y,width,height` in the query or as a field.";
        Self::new(Kind::MissingBox, detail)
    }

    /// No route has this path.
    pub fn route_not_found() -> Self {
        Self::new(Kind::RouteNotFound, "See /docs for the paths there are.")
    }

    /// No live session has this id.
    pub fn session_not_found() -> Self {
        let detail = "The session was never opened here, was deleted or has expired; open a new one with POST /sessions.";
        Self::new(Kind::SessionNotFound, detail)
    }

    /// The route has other methods.
    pub fn method_not_allowed() -> Self {
        Self::new(
            Kind::MethodNotAllowed,
            "The header `Allow` lists the methods there are.",
        )
    }

    /// The body did not arrive in time.
    pub fn body_timeout() -> Self {
        let detail = "Send the whole body faster, or a smaller frame. The session is unchanged.";
        Self::new(Kind::BodyTimeout, detail)
    }

    /// The body has more bytes than it may.
    pub fn body_too_large(limit: usize) -> Self {
        let detail =
            format!("A body may have at most {limit} bytes; send smaller or fewer frames.");
        Self::new(Kind::BodyTooLarge, detail)
    }

    /// The request has more frames than it may.
    pub fn too_many_frames(limit: usize) -> Self {
        let detail = format!(
            "A request may have at most {limit} frames here; send the rest in another one."
        );
        Self::new(Kind::TooManyFrames, detail)
    }

    /// The frame number does not fit.
    pub fn replay(error: ReplayError) -> Self {
        let (kind, detail, expected) = match error {
            ReplayError::OutOfOrder { got, expected } => (
                Kind::FrameOutOfOrder,
                format!("This session expects frame {expected}, and frame {got} was sent."),
                expected,
            ),
            ReplayError::Differs { got, expected } => (
                Kind::FrameDiffers,
                format!(
                    "Frame {got} was answered for other bytes; a new frame has the number {expected}."
                ),
                expected,
            ),
        };
        let mut problem = Self::new(kind, detail);
        problem.expected_frame = Some(expected);
        problem
    }

    /// The bytes are not a frame.
    pub fn ingest(error: &IngestError) -> Self {
        let (kind, detail) = match error {
            IngestError::UnknownFormat => (
                Kind::UnsupportedImage,
                "The type is taken from the bytes; send a JPEG, PNG or WebP image.".to_owned(),
            ),
            IngestError::TooLarge(limit) => (
                Kind::FrameTooLarge,
                format!("{limit}. Send a smaller frame."),
            ),
            damaged => (
                Kind::FrameDamaged,
                format!("{damaged}. Send the whole file again."),
            ),
        };
        Self::new(kind, detail)
    }

    /// The tracker did not take the frame, the box or the parameters.
    pub fn tracker(error: TrackerError) -> Self {
        match error {
            TrackerError::Params(error) => Self::invalid_parameter(error.to_string()),
            TrackerError::Target(_) => Self::new(Kind::InvalidBox, format!("{error}.")),
            TrackerError::FrameSize { .. } => {
                let detail = format!("{error}. Open a new session for frames of another size.");
                Self::new(Kind::FrameSizeMismatch, detail)
            }
            other => Self::internal(Arc::new(other)),
        }
    }

    /// A parameter is unknown, has the wrong type or is out of its range.
    pub fn invalid_parameter(detail: impl Into<String>) -> Self {
        Self::new(Kind::InvalidParameter, detail)
    }

    /// The bytes are not a session.
    pub fn invalid_snapshot(error: EnvelopeError) -> Self {
        let detail = format!("{error}. Send the bytes of GET /sessions/{{id}}/snapshot unchanged.");
        Self::new(Kind::InvalidSnapshot, detail).caused_by(Arc::new(error))
    }

    /// All places at the session are taken.
    pub fn session_busy() -> Self {
        let detail = "Wait for the answers to the frames already sent. The session is unchanged.";
        Self::new(Kind::SessionBusy, detail)
    }

    /// All places in the queue are taken.
    pub fn queue_full() -> Self {
        Self::new(
            Kind::QueueFull,
            "Try again after the time in `Retry-After`. Nothing was changed.",
        )
    }

    /// There is no room for another session.
    pub fn too_many_sessions() -> Self {
        let detail =
            "Delete sessions that have ended, or try again after the time in `Retry-After`.";
        Self::new(Kind::TooManySessions, detail)
    }

    /// The work took too long.
    pub fn work_timeout() -> Self {
        let detail = "Try again after the time in `Retry-After`. A frame sent with its number (`?frame=N`) is never tracked twice.";
        Self::new(Kind::WorkTimeout, detail)
    }

    /// The service is about to end.
    pub fn not_ready() -> Self {
        Self::new(Kind::NotReady, "Send requests to another instance.")
    }

    /// The service failed.
    pub fn internal(cause: Arc<dyn Error + Send + Sync>) -> Self {
        Self::panicked().caused_by(cause)
    }

    /// The service failed, and the log has it already.
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

    fn caused_by(mut self, cause: Arc<dyn Error + Send + Sync>) -> Self {
        self.cause = Some(cause);
        self
    }

    /// Its kind.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// The real cause and its causes, for the log.
    pub fn cause(&self) -> Option<String> {
        let mut error: &dyn Error = self.cause.as_deref()?;
        let mut text = error.to_string();
        while let Some(source) = error.source() {
            text = format!("{text}: {source}");
            error = source;
        }
        Some(text)
    }

    /// The document, for the request at this path with this id.
    pub fn document(&self, instance: String, request_id: String) -> Document {
        Document {
            r#type: self.kind.urn(),
            title: self.kind.title(),
            status: self.kind.status().as_u16(),
            detail: self.detail.clone(),
            instance,
            request_id,
            expected_frame: self.expected_frame,
            index: self.index,
        }
    }

    /// The response, for the request at this path with this id.
    pub fn respond(&self, instance: String, request_id: String) -> Response {
        let document = Json(self.document(instance, request_id));
        let mut response = (self.kind.status(), document).into_response();
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static(MEDIA_TYPE));
        if let Some(seconds) = self.kind.retry_after() {
            headers.insert(RETRY_AFTER, HeaderValue::from(seconds));
        }
        response
    }
}

impl IntoResponse for Problem {
    /// The status alone: the outermost middleware writes the document, since it knows the request.
    fn into_response(self) -> Response {
        let mut response = self.kind.status().into_response();
        response.extensions_mut().insert(self);
        response
    }
}
