//! The catalogue of problem kinds: each has a status, a name and a title that never change, its usual causes and their
//! cure. The answers, the OpenAPI document and the page `/docs/problems` are made from it.

/// The path of the page that describes all kinds, below the service's base path.
pub const PROBLEMS_PAGE: &str = "/docs/problems";

/// A kind's entry in the catalogue.
struct Entry {
    status: u16,
    slug: &'static str,
    title: &'static str,
    cause: &'static str,
    cure: &'static str,
}

/// Makes [`ProblemKind`] and the catalogue from one list, so that every kind has a complete entry.
macro_rules! kinds {
    ($($name:ident: $status:literal $slug:literal $title:literal cause: $cause:literal cure: $cure:literal)*) => {
        /// A kind of problem: one problem type of the interface.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum ProblemKind {
            $(#[doc = $title] $name,)*
        }

        impl ProblemKind {
            /// All kinds, in the order of their statuses.
            pub const ALL: &'static [Self] = &[$(Self::$name,)*];

            fn entry(self) -> Entry {
                match self {
                    $(Self::$name => Entry {
                        status: $status,
                        slug: $slug,
                        title: $title,
                        cause: $cause,
                        cure: $cure,
                    },)*
                }
            }
        }
    };
}

kinds! {
    MalformedRequest: 400 "malformed-request" "The request cannot be read"
        cause: "A setting is unknown, doubled or no value of its type; the body is no valid JSON or form; or a \
            call got settings that it does not take."
        cure: "Read `detail`: it names the setting. The settings of each call are at `/docs`."
    MissingFrame: 400 "missing-frame" "There is no frame in the request"
        cause: "The body is empty, or its file has another name than `frame`."
        cure: "Send the image as the body (`curl --data-binary @frame.jpg`), as the form's part `frame`, or as \
            base64 in the JSON field `frame`."
    MissingBox: 400 "missing-box" "There is no box in the request"
        cause: "A session begins with a first frame and the target's box in it, and the request has no box."
        cure: "Send `box=x,y,width,height` in pixels of the frame, in the query or as a field; `boxes` for \
            several targets."
    Unauthorized: 401 "unauthorized" "The request has no valid API key"
        cause: "The service has API keys, or an issuer of tokens, and the request came without one, or with one that it \
            does not know or that has ended: `detail` says why."
        cure: "Send `Authorization: Bearer KEY`, or `Bearer TOKEN` of the issuer. For a session token that has ended, make a new one with `POST \
            /sessions/{id}/token`."
    Forbidden: 403 "forbidden" "A session token is not good for this"
        cause: "A session token opens one session and nothing else."
        cure: "Send the call with an API key."
    OriginNotAllowed: 403 "origin-not-allowed" "Pages of this origin may not use the service"
        cause: "A browser sent the request for a page of another origin."
        cure: "Start the service with the page's origin in `--cors-origins`."
    RouteNotFound: 404 "route-not-found" "There is nothing at this path"
        cause: "The path is misspelt, or ends with a slash."
        cure: "See `/docs` for the paths."
    SessionNotFound: 404 "session-not-found" "There is no such session"
        cause: "The session was deleted, another API key opened it, or the service was restarted and has no \
            store."
        cure: "Open a new session. A client that keeps snapshots (`GET /sessions/{id}/snapshot`) goes on from \
            the last one."
    MethodNotAllowed: 405 "method-not-allowed" "The path does not take this method"
        cause: "The path is right, and the method is not."
        cure: "Use one of the methods in the header `Allow`."
    BodyTimeout: 408 "body-timeout" "The body took too long to arrive"
        cause: "The line is slow, or stood still."
        cure: "Send the request again. For a slow line send smaller frames or a lower JPEG quality."
    FrameOutOfOrder: 409 "frame-out-of-order" "The frame number is out of order"
        cause: "Frame numbers count up by one, and this one is neither the next nor among the last."
        cure: "Go on with the number in `expected_frame`."
    NotInOrder: 409 "not-in-order" "Frames without numbers came at the same time"
        cause: "Two requests with frames were on their way to one session, and nothing tells their order. The \
            second was not tracked."
        cure: "Wait for each answer, or number the frames: `?frame=N`."
    SessionExists: 409 "session-exists" "Another session has this id"
        cause: "`PUT /sessions/{id}` was sent for a live session with another frame, other settings or another \
            key."
        cure: "Make a new id (UUID)."
    FrameDiffers: 409 "frame-differs" "The frame number was used for another frame"
        cause: "A frame may be sent again under its number, with the same bytes. These are others."
        cure: "Send the bytes of the first time, or the new frame with the number in `expected_frame`."
    SessionExpired: 410 "session-expired" "The session has expired"
        cause: "No frame came in time: within 60 seconds after the opening, or 10 minutes after the last one, \
            unless the service is set otherwise."
        cure: "Open a new session. `expires_at` tells how long one waits."
    BodyTooLarge: 413 "body-too-large" "The body is too large"
        cause: "The body has more bytes than `--max-body-bytes`."
        cure: "Send fewer or smaller frames in a request; a long video in parts."
    RequestTooCostly: 413 "request-too-costly" "The frames of the request cost too much together"
        cause: "The frames of one request have too many pixels together, or took too much processor time. None \
            was tracked, unless lines were answered before."
        cure: "Send fewer or smaller frames in a request."
    FrameTooLarge: 413 "frame-too-large" "The frame is too large"
        cause: "A side, the number of pixels or the number of bytes is over the service's limit."
        cure: "Send a smaller frame. 1280 pixels on the longer side are enough for most targets."
    TooManyFrames: 413 "too-many-frames" "There are too many frames in the request"
        cause: "A request has more frames than `--max-frames`, or a video more than `--max-video-frames`."
        cure: "Send the rest in another request."
    UnsupportedImage: 415 "unsupported-image" "The frame is not a JPEG, PNG or WebP image"
        cause: "The file is of another type (HEIC, AVIF, BMP, TIFF), no image at all, or a video where none is \
            taken."
        cure: "Send JPEG, PNG or WebP. iPhone: Settings, Camera, Formats, Most Compatible. Videos go to `POST \
            /track` or `POST /sessions/{id}/frames`, where the service has an ffmpeg."
    HostNotAllowed: 421 "host-not-allowed" "The service is not for this host"
        cause: "The request names a host that the service was not told of. This guards against DNS rebinding."
        cure: "Start the service with this host in `--allowed-hosts`."
    FrameDamaged: 422 "frame-damaged" "The frame cannot be decoded"
        cause: "The file was cut short or changed on its way (`curl -d` strips line breaks: use \
            `--data-binary`), or is of a kind that the decoder does not take."
        cure: "Send the whole file again."
    FrameSizeMismatch: 422 "frame-size-mismatch" "The frame has another size than the session's frames"
        cause: "All frames of a session have the size of the first one, after their EXIF orientation. Often a \
            phone was turned, or a thumbnail sent."
        cure: "Send frames of that size, or open a new session."
    InvalidBox: 422 "invalid-box" "The box cannot be tracked"
        cause: "The box is too small or too large, has a negative side, or lies outside the frame. Often it is \
            x1,y1,x2,y2, or in fractions of the frame."
        cure: "Send `x,y,width,height` in pixels of the uploaded frame, the origin at its top left. Each side \
            has at least 4 pixels."
    InvalidParameter: 422 "invalid-parameter" "A parameter cannot be used"
        cause: "A parameter of the tracker is unknown, of the wrong type or out of its range, or several are too \
            much together."
        cure: "Read `detail`: it tells the range. All parameters are at `/docs`."
    InvalidSnapshot: 422 "invalid-snapshot" "The snapshot cannot be restored"
        cause: "The bytes were changed, have a format that this version does not read, or were signed with other keys."
        cure: "Send the bytes of `GET /sessions/{id}/snapshot` unchanged, to a service that has the \
            same `BAGTRACK_SNAPSHOT_KEYS` and reads that format."
    IdempotencyKeyReused: 422 "idempotency-key-reused" "The idempotency key was used for another request"
        cause: "The same `Idempotency-Key` came with another frame or other settings."
        cure: "Make a new key for each session."
    SessionBusy: 429 "session-busy" "Too many requests wait for this session"
        cause: "More requests than `--session-queue` wait for one session. The session is unchanged."
        cure: "Wait for answers before sending more, or use the stream."
    QuotaExceeded: 429 "quota-exceeded" "The client has used up its share"
        cause: "One client may have so many sessions, requests, connections and frames a second. `RateLimit` \
            tells what is left."
        cure: "Try again after `Retry-After`. Delete sessions that are done."
    Internal: 500 "internal" "The service failed"
        cause: "A fault of the service."
        cure: "Report it with the `request_id`: the log has the cause under this id."
    QueueFull: 503 "queue-full" "The service is busy"
        cause: "More work waits than the service takes, or the client's frames wait too long for a worker \
            (`--queue-delay`). Nothing was changed."
        cure: "Try again after `Retry-After`."
    TooManySessions: 503 "too-many-sessions" "The service holds as many sessions as it may"
        cause: "There are `--max-sessions` live sessions, or as many as the memory allows."
        cure: "Delete sessions that have ended, or try again after `Retry-After`."
    WorkTimeout: 503 "work-timeout" "The work took too long"
        cause: "The request waited or worked longer than `--work-timeout`. Whether its frame was taken is not \
            known."
        cure: "Send the frame again with its number (`?frame=N`): it is never tracked twice."
    NotReady: 503 "not-ready" "The service is not ready"
        cause: "The service is about to end, or something of it is full."
        cure: "Open sessions at another instance, or try again after `Retry-After`."
    StoreUnavailable: 503 "store-unavailable" "The store of the sessions gives no answer"
        cause: "The Redis of `--store` cannot be reached, or its folder cannot be written. The frame does not count."
        cure: "Send the request again after `Retry-After`, with its number (`?frame=N`)."
}

impl ProblemKind {
    /// The kind's name: the last part of the problem type.
    pub fn slug(self) -> &'static str {
        self.entry().slug
    }

    /// The problem type: the address of the kind's section of the problems page, for a service below `base_path`.
    pub fn uri(self, base_path: &str) -> String {
        format!("{base_path}{PROBLEMS_PAGE}#{}", self.slug())
    }

    /// The status code of the response.
    pub fn status(self) -> u16 {
        self.entry().status
    }

    /// The title: the kind in a few words, the same for every occurrence.
    pub fn title(self) -> &'static str {
        self.entry().title
    }

    /// The usual causes, with code in backticks.
    pub fn cause(self) -> &'static str {
        self.entry().cause
    }

    /// What to do, with code in backticks.
    pub fn cure(self) -> &'static str {
        self.entry().cure
    }

    /// Seconds after which trying again makes sense; `None` where it does not.
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
}
