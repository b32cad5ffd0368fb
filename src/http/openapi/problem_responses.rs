//! The OpenAPI document, generated from the handlers.

use super::problem::{self, Problem};
use super::problem_kind::Kind;
use super::router;
use std::collections::BTreeMap;
use utoipa::openapi::{
    ContentBuilder, HeaderBuilder, ObjectBuilder, OpenApi, Ref, RefOr, Response, ResponseBuilder,
    example::ExampleBuilder, schema::Type,
};

#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "bagtrack",
        description = "Follows one object through the frames that you upload. The first frame and a box open a \
            session; every further frame gets a box back.\n\n\
            A frame is sent as a raw body (the settings are in the query), as `multipart/form-data`, or as JSON \
            with base64. Its type is taken from its bytes: JPEG, PNG or WebP. Boxes are in the pixels of the \
            uploaded frame. Every error is a problem document (RFC 9457) and leaves the session as it was, but for \
            `work-timeout`, which says what to do. Paths that do not exist answer `route-not-found` (404)."
    ),
    tags(
        (name = "sessions", description = "Open a session, send frames, end it"),
        (name = "service", description = "The service itself")
    ),
    components(schemas(problem::Document))
)]
pub struct Api;

/// The whole document.
pub fn document() -> OpenApi {
    router::api().into_openapi()
}

/// What every operation may answer: it may fail.
pub const ALWAYS: &[Kind] = &[Kind::Internal];

/// What every operation with frames may answer.
pub const UPLOAD: &[Kind] = &[
    Kind::MalformedRequest,
    Kind::MissingFrame,
    Kind::BodyTimeout,
    Kind::BodyTooLarge,
    Kind::FrameTooLarge,
    Kind::TooManyFrames,
    Kind::UnsupportedImage,
    Kind::FrameDamaged,
    Kind::QueueFull,
    Kind::WorkTimeout,
    Kind::Internal,
];

/// The responses of these problems: one a status, with an example a kind.
pub fn problems(kinds: &[&[Kind]]) -> BTreeMap<String, RefOr<Response>> {
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

const EXAMPLE_ID: &str = "1da43888-6f49-40f8-a05c-7bb628ba4f6a";

fn response(kinds: &[Kind]) -> Response {
    let titles: Vec<&str> = kinds.iter().map(|kind| kind.title()).collect();
    let examples = kinds.iter().map(|kind| {
        let document = example(*kind).document("/sessions".to_owned(), EXAMPLE_ID.to_owned());
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
        .content(problem::MEDIA_TYPE, content);
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
    use crate::ingest::IngestError;
    use crate::sessions::{EnvelopeError, ReplayError};
    use crate::tracker::TrackerError;
    match kind {
        Kind::MalformedRequest => Problem::malformed("`box` is given twice; give it once."),
        Kind::MissingFrame => Problem::missing_frame(),
        Kind::MissingBox => Problem::missing_box(),
        Kind::RouteNotFound => Problem::route_not_found(),
        Kind::SessionNotFound => Problem::session_not_found(),
        Kind::MethodNotAllowed => Problem::method_not_allowed(),
        Kind::BodyTimeout => Problem::body_timeout(),
        Kind::FrameOutOfOrder => Problem::replay(ReplayError::OutOfOrder {
            got: 9,
            expected: 4,
        }),
        Kind::FrameDiffers => Problem::replay(ReplayError::Differs {
            got: 3,
            expected: 4,
        }),
        Kind::BodyTooLarge => Problem::body_too_large(33_554_432),
        Kind::FrameTooLarge => {
            let limit = "a side of 9000 px is over the limit of 8192 px".to_owned();
            Problem::ingest(&IngestError::TooLarge(limit))
        }
        Kind::TooManyFrames => Problem::too_many_frames(64),
        Kind::UnsupportedImage => Problem::ingest(&IngestError::UnknownFormat),
        Kind::FrameDamaged => Problem::ingest(&IngestError::Damaged {
            format: "JPEG",
            reason: "the data ends early".to_owned(),
        }),
        Kind::FrameSizeMismatch => Problem::tracker(TrackerError::FrameSize {
            width: 320,
            height: 240,
            got_width: 640,
            got_height: 480,
        }),
        Kind::InvalidBox => Problem::tracker(TrackerError::Target("does not touch the frame")),
        Kind::InvalidParameter => {
            Problem::invalid_parameter("There is no parameter `colour`; the parameters are …")
        }
        Kind::InvalidSnapshot => Problem::invalid_snapshot(EnvelopeError::Damaged),
        Kind::SessionBusy => Problem::session_busy(),
        Kind::Internal => Problem::panicked(),
        Kind::QueueFull => Problem::queue_full(),
        Kind::TooManySessions => Problem::too_many_sessions(),
        Kind::WorkTimeout => Problem::work_timeout(),
        Kind::NotReady => Problem::not_ready(),
    }
}
