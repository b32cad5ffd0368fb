//! The problem responses in the OpenAPI document: one for the client's faults and one for the service's, which name the
//! kinds of the operation.

use crate::http::problems::document::MEDIA_TYPE;
use crate::http::problems::kind::Kind;
use std::collections::BTreeMap;
use utoipa::openapi::schema::{KnownFormat, SchemaFormat, Type};
use utoipa::openapi::{
    ContentBuilder, HeaderBuilder, ObjectBuilder, Ref, RefOr, Response, ResponseBuilder,
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

/// The responses of these problems, one for each class of statuses. Each kind leads to its section of the page about
/// problems, which stands beside the document's.
pub fn problem_responses(kinds: &[&[Kind]]) -> BTreeMap<String, RefOr<Response>> {
    let mut by_class: BTreeMap<u16, Vec<Kind>> = BTreeMap::new();
    for kind in kinds.concat() {
        let class = kind.status().as_u16() / 100;
        by_class.entry(class).or_default().push(kind);
    }
    let responses = by_class.into_iter().map(|(class, mut kinds)| {
        kinds.sort();
        (format!("{class}XX"), RefOr::T(response(&kinds)))
    });
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

fn response(kinds: &[Kind]) -> Response {
    let links = kinds.iter().map(|kind| {
        let (slug, status) = (kind.slug(), kind.status().as_u16());
        format!("[{slug}](problems#{slug}) ({status})")
    });
    let links: Vec<String> = links.collect();
    let content = ContentBuilder::new()
        .schema(Some(Ref::from_schema_name("Problem")))
        .build();
    let mut response = ResponseBuilder::new()
        .description(format!("A problem: {}", links.join(", ")))
        .content(MEDIA_TYPE, content);
    if kinds.iter().any(|kind| kind.retry_after().is_some()) {
        let seconds = ObjectBuilder::new()
            .schema_type(Type::Integer)
            .format(Some(SchemaFormat::KnownFormat(KnownFormat::Int32)));
        let header = HeaderBuilder::new().schema(Some(seconds)).description(Some(
            "Seconds after which trying again makes sense, with 429 and 503.",
        ));
        response = response.header("Retry-After", header.build());
    }
    response.build()
}
