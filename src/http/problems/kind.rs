//! The catalogue of problem kinds: each has a type, a status and a title that never change.

use axum::http::StatusCode;

/// A kind of problem: one problem type of the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "`title` says what each one is")]
pub enum Kind {
    MalformedRequest,
    MissingFrame,
    MissingBox,
    Unauthorized,
    Forbidden,
    OriginNotAllowed,
    RouteNotFound,
    SessionNotFound,
    MethodNotAllowed,
    BodyTimeout,
    FrameOutOfOrder,
    NotInOrder,
    SessionExists,
    SessionExpired,
    BodyTooLarge,
    RequestTooCostly,
    FrameTooLarge,
    TooManyFrames,
    UnsupportedImage,
    HostNotAllowed,
    FrameDamaged,
    FrameSizeMismatch,
    FrameDiffers,
    InvalidBox,
    InvalidParameter,
    InvalidSnapshot,
    IdempotencyKeyReused,
    SessionBusy,
    QuotaExceeded,
    Internal,
    QueueFull,
    TooManySessions,
    WorkTimeout,
    NotReady,
    StoreUnavailable,
}

impl Kind {
    /// The last part of the problem type: `urn:bagtrack:problem:<slug>`.
    pub fn slug(self) -> &'static str {
        self.entry().1
    }

    /// The problem type.
    pub fn urn(self) -> String {
        format!("urn:bagtrack:problem:{}", self.slug())
    }

    /// The status it is answered with.
    pub fn status(self) -> StatusCode {
        StatusCode::from_u16(self.entry().0).expect("the catalogue holds valid status codes")
    }

    /// What it is, in a few words; the same for every occurrence.
    pub fn title(self) -> &'static str {
        self.entry().2
    }

    /// Seconds after which trying again makes sense, where it does.
    pub fn retry_after(self) -> Option<u32> {
        match self {
            Self::SessionBusy
            | Self::QuotaExceeded
            | Self::QueueFull
            | Self::WorkTimeout
            | Self::StoreUnavailable => Some(1),
            Self::NotReady => Some(5),
            Self::TooManySessions => Some(10),
            _ => None,
        }
    }

    #[rustfmt::skip]
    fn entry(self) -> (u16, &'static str, &'static str) {
        match self {
            Self::MalformedRequest => (400, "malformed-request", "The request cannot be read"),
            Self::MissingFrame => (400, "missing-frame", "There is no frame in the request"),
            Self::MissingBox => (400, "missing-box", "There is no box in the request"),
            Self::Unauthorized => (401, "unauthorized", "The request has no valid API key"),
            Self::Forbidden => (403, "forbidden", "A session token is not good for this"),
            Self::OriginNotAllowed => (403, "origin-not-allowed", "Pages of this origin may not use the service"),
            Self::RouteNotFound => (404, "route-not-found", "There is nothing at this path"),
            Self::SessionNotFound => (404, "session-not-found", "There is no such session"),
            Self::MethodNotAllowed => (405, "method-not-allowed", "The path does not take this method"),
            Self::BodyTimeout => (408, "body-timeout", "The body took too long to arrive"),
            Self::FrameOutOfOrder => (409, "frame-out-of-order", "The frame number is out of order"),
            Self::NotInOrder => (409, "not-in-order", "Frames without numbers came at the same time"),
            Self::SessionExists => (409, "session-exists", "Another session has this id"),
            Self::SessionExpired => (410, "session-expired", "The session has expired"),
            Self::BodyTooLarge => (413, "body-too-large", "The body is too large"),
            Self::RequestTooCostly => (413, "request-too-costly", "The frames of the request cost too much together"),
            Self::FrameTooLarge => (413, "frame-too-large", "The frame is too large"),
            Self::TooManyFrames => (413, "too-many-frames", "There are too many frames in the request"),
            Self::UnsupportedImage => (415, "unsupported-image", "The frame is not a JPEG, PNG or WebP image"),
            Self::HostNotAllowed => (421, "host-not-allowed", "The service is not for this host"),
            Self::FrameDamaged => (422, "frame-damaged", "The frame cannot be decoded"),
            Self::FrameSizeMismatch => (422, "frame-size-mismatch", "The frame has another size than the session's frames"),
            Self::FrameDiffers => (409, "frame-differs", "The frame number was used for another frame"),
            Self::InvalidBox => (422, "invalid-box", "The box cannot be tracked"),
            Self::InvalidParameter => (422, "invalid-parameter", "A parameter cannot be used"),
            Self::InvalidSnapshot => (422, "invalid-snapshot", "The snapshot cannot be restored"),
            Self::IdempotencyKeyReused => (422, "idempotency-key-reused", "The idempotency key was used for another request"),
            Self::SessionBusy => (429, "session-busy", "Too many requests wait for this session"),
            Self::QuotaExceeded => (429, "quota-exceeded", "The client has used up its share"),
            Self::Internal => (500, "internal", "The service failed"),
            Self::QueueFull => (503, "queue-full", "The service is busy"),
            Self::TooManySessions => (503, "too-many-sessions", "The service holds as many sessions as it may"),
            Self::WorkTimeout => (503, "work-timeout", "The work took too long"),
            Self::NotReady => (503, "not-ready", "The service is not ready"),
            Self::StoreUnavailable => (503, "store-unavailable", "The store of the sessions gives no answer"),
        }
    }
}
