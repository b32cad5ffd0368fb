//! The problem responses in the OpenAPI document: one for each status, with an example for each kind.

use crate::http::problems::document::{MEDIA_TYPE, ProblemDocument};
use crate::http::problems::kind::Kind;
use crate::http::problems::problem::Problem;
use bagtrack_ingest::IngestError;
use bagtrack_sessions::{
    QueueFull, ReplayError, SessionBusy, SnapshotError, StoreUnavailable, TooManySessions,
};
use bagtrack_tracker::TrackerError;
use std::collections::BTreeMap;
use utoipa::openapi::{
    ContentBuilder, HeaderBuilder, ObjectBuilder, Ref, RefOr, Response, ResponseBuilder,
    example::ExampleBuilder, schema::Type,
};

/// The problem that every operation may answer.
pub const ALWAYS: &[Kind] = &[Kind::Internal];

/// The problems that every operation on a session may answer.
pub const SESSION: &[Kind] = &[
    Kind::Unauthorized,
    Kind::SessionNotFound,
    Kind::SessionExpired,
    Kind::StoreUnavailable,
];

/// The problems that every operation with frames may answer.
pub const UPLOAD: &[Kind] = &[
    Kind::MalformedRequest,
    Kind::MissingFrame,
    Kind::BodyTimeout,
    Kind::BodyTooLarge,
    Kind::FrameTooLarge,
    Kind::TooManyFrames,
    Kind::UnsupportedImage,
    Kind::FrameDamaged,
    Kind::QuotaExceeded,
    Kind::QueueFull,
    Kind::WorkTimeout,
    Kind::Internal,
];

/// The responses of these problems: one for each status, with an example for each kind.
pub fn problem_responses(kinds: &[&[Kind]]) -> BTreeMap<String, RefOr<Response>> {
    let mut by_status: BTreeMap<u16, Vec<Kind>> = BTreeMap::new();
    for kind in kinds.concat() {
        by_status
            .entry(kind.status().as_u16())
            .or_default()
            .push(kind);
    }
    let responses = by_status
        .into_iter()
        .map(|(status, kinds)| (status.to_string(), RefOr::T(response(&kinds))));
    responses.collect()
}

/// Names the problems of an operation, for its `responses(…)`.
macro_rules! operation_problems {
    ($name:ident, $($kinds:expr),+) => {
        struct $name;

        impl utoipa::IntoResponses for $name {
            fn responses() -> std::collections::BTreeMap<
                String,
                utoipa::openapi::RefOr<utoipa::openapi::Response>,
            > {
                $crate::http::openapi::problem_responses::problem_responses(&[$($kinds),+])
            }
        }
    };
}
pub(crate) use operation_problems;

const EXAMPLE_ID: &str = "1da43888-6f49-40f8-a05c-7bb628ba4f6a";

fn response(kinds: &[Kind]) -> Response {
    let titles: Vec<&str> = kinds.iter().map(|kind| kind.title()).collect();
    let examples = kinds.iter().map(|kind| {
        let (instance, id) = ("/sessions".to_owned(), EXAMPLE_ID.to_owned());
        let document = ProblemDocument::new(&example(*kind), instance, id);
        let value = serde_json::to_value(document).expect("a problem document is plain JSON");
        let example = ExampleBuilder::new()
            .summary(kind.title())
            .value(Some(value));
        (kind.slug(), example.build())
    });
    let content = ContentBuilder::new()
        .schema(Some(Ref::from_schema_name("Problem")))
        .examples_from_iter(examples)
        .build();
    let mut response = ResponseBuilder::new()
        .description(titles.join("; or: "))
        .content(MEDIA_TYPE, content);
    if kinds.iter().any(|kind| kind.retry_after().is_some()) {
        let seconds = ObjectBuilder::new().schema_type(Type::Integer);
        let header = HeaderBuilder::new()
            .schema(Some(seconds))
            .description(Some("Seconds after which trying again makes sense."));
        response = response.header("Retry-After", header.build());
    }
    response.build()
}

fn example(kind: Kind) -> Problem {
    match kind {
        Kind::MalformedRequest => Problem::malformed("`box` is given twice; give it once."),
        Kind::MissingFrame => Problem::missing_frame(),
        Kind::MissingBox => Problem::missing_box(),
        Kind::Unauthorized => Problem::unauthorized(),
        Kind::Forbidden => Problem::forbidden(),
        Kind::OriginNotAllowed => Problem::origin_not_allowed(),
        Kind::HostNotAllowed => Problem::host_not_allowed(),
        Kind::SessionExpired => Problem::session_expired(),
        Kind::SessionExists => Problem::session_exists(),
        Kind::IdempotencyKeyReused => Problem::idempotency_key_reused(),
        Kind::RouteNotFound => Problem::route_not_found(),
        Kind::SessionNotFound => Problem::session_not_found(),
        Kind::MethodNotAllowed => Problem::method_not_allowed(),
        Kind::BodyTimeout => Problem::body_timeout(),
        Kind::NotInOrder => Problem::not_in_order(),
        Kind::FrameOutOfOrder => Problem::from(ReplayError::OutOfOrder {
            got: 9,
            expected: 4,
        }),
        Kind::FrameDiffers => Problem::from(ReplayError::Differs {
            got: 3,
            expected: 4,
        }),
        Kind::BodyTooLarge => Problem::body_too_large(33_554_432),
        Kind::RequestTooCostly => Problem::too_many_pixels(500_000_000, 160_000_000),
        Kind::FrameTooLarge => {
            let limit = "a side of 9000 px is over the limit of 8192 px".to_owned();
            IngestError::TooLarge(limit).into()
        }
        Kind::TooManyFrames => Problem::too_many_frames(64),
        Kind::UnsupportedImage => IngestError::UnknownFormat.into(),
        Kind::FrameDamaged => Problem::from(IngestError::Damaged {
            format: "JPEG",
            reason: "the data ends early".to_owned(),
        }),
        Kind::FrameSizeMismatch => Problem::from(TrackerError::FrameSize {
            width: 320,
            height: 240,
            got_width: 640,
            got_height: 480,
        }),
        Kind::InvalidBox => Problem::from(TrackerError::Target("does not touch the frame")),
        Kind::InvalidParameter => {
            Problem::invalid_parameter("There is no parameter `colour`; the parameters are …")
        }
        Kind::InvalidSnapshot => SnapshotError::Damaged.into(),
        Kind::SessionBusy => SessionBusy.into(),
        Kind::QuotaExceeded => Problem::quota_exceeded("requests in flight", 64),
        Kind::Internal => Problem::panicked(),
        Kind::QueueFull => QueueFull.into(),
        Kind::TooManySessions => TooManySessions(1024).into(),
        Kind::WorkTimeout => Problem::work_timeout(),
        Kind::NotReady => Problem::not_ready(),
        Kind::StoreUnavailable => StoreUnavailable::default().into(),
    }
}
