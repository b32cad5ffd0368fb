//! The problems that each operation may answer, and their responses in the OpenAPI document: one response for the
//! client's faults (`4XX`) and one for the service's (`5XX`).

use crate::ProblemKind as Kind;
use crate::media_types::PROBLEM;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// What every operation on a session may answer.
const SESSION: &[Kind] = &[
    Kind::Unauthorized,
    Kind::SessionNotFound,
    Kind::SessionExpired,
    Kind::StoreUnavailable,
];

/// What every operation with frames may answer.
const UPLOAD: &[Kind] = &[
    Kind::MalformedRequest,
    Kind::MissingFrame,
    Kind::BodyTimeout,
    Kind::BodyTooLarge,
    Kind::FrameTooLarge,
    Kind::TooManyFrames,
    Kind::UnsupportedImage,
    Kind::FrameDamaged,
    Kind::RequestTooCostly,
    Kind::QuotaExceeded,
    Kind::QueueFull,
    Kind::WorkTimeout,
];

/// What every operation that begins a track may answer.
const START: &[Kind] = &[
    Kind::Unauthorized,
    Kind::Forbidden,
    Kind::MissingBox,
    Kind::InvalidBox,
    Kind::InvalidParameter,
    Kind::InvalidSnapshot,
];

/// What every operation that opens a session may answer.
const OPEN: &[Kind] = &[
    Kind::TooManySessions,
    Kind::NotReady,
    Kind::StoreUnavailable,
];

/// What every operation with frames of a session may answer.
const FRAMES: &[Kind] = &[
    Kind::FrameOutOfOrder,
    Kind::NotInOrder,
    Kind::FrameDiffers,
    Kind::FrameSizeMismatch,
    Kind::SessionBusy,
];

/// What every operation that looks at a session's state may answer.
const READ: &[Kind] = &[
    Kind::MalformedRequest,
    Kind::SessionBusy,
    Kind::QuotaExceeded,
    Kind::QueueFull,
    Kind::WorkTimeout,
];

/// The problems of an operation, besides `Internal`, which every operation may answer.
fn kinds(operation_id: &str) -> Vec<Kind> {
    use Kind::*;
    let kinds: &[&[Kind]] = match operation_id {
        "createSession" => &[UPLOAD, START, OPEN, &[IdempotencyKeyReused]],
        "putSession" => &[UPLOAD, START, OPEN, &[SessionExists]],
        "track" => &[UPLOAD, START, &[FrameSizeMismatch]],
        "getVideoFrames" => &[UPLOAD, &[Unauthorized, Forbidden]],
        "postFrames" => &[UPLOAD, SESSION, FRAMES],
        "putTarget" => &[UPLOAD, SESSION, FRAMES, &[MissingBox, InvalidBox]],
        "getSnapshot" | "getBagPicture" => &[SESSION, READ],
        "getSession" | "deleteSession" => &[SESSION, &[MalformedRequest]],
        "createToken" => &[SESSION, &[MalformedRequest, Forbidden]],
        "openStream" => {
            let others = &[
                MalformedRequest,
                FrameOutOfOrder,
                SessionBusy,
                QuotaExceeded,
                WorkTimeout,
            ];
            &[SESSION, others]
        }
        "getMetrics" => &[&[MalformedRequest, Unauthorized, Forbidden]],
        "getVersion" => &[&[MalformedRequest]],
        "getReadiness" => &[&[NotReady]],
        "getHealth" => &[],
        other => unreachable!("the problems of {other} are not listed"),
    };
    kinds.concat()
}

/// The problem responses of an operation, by class of status (`4XX`, `5XX`). Each kind links to its section of the
/// problems page, relative to the page of the document.
pub(super) fn problem_responses(operation_id: &str) -> Map<String, Value> {
    let mut by_class: BTreeMap<u16, Vec<Kind>> = BTreeMap::new();
    for kind in kinds(operation_id).into_iter().chain([Kind::Internal]) {
        let class = kind.status() / 100;
        by_class.entry(class).or_default().push(kind);
    }
    let responses = by_class.into_iter().map(|(class, mut kinds)| {
        kinds.sort();
        (format!("{class}XX"), response(&kinds))
    });
    responses.collect()
}

fn response(kinds: &[Kind]) -> Value {
    let links = kinds.iter().map(|kind| {
        let (slug, status) = (kind.slug(), kind.status());
        format!("[{slug}](problems#{slug}) ({status})")
    });
    let links: Vec<String> = links.collect();
    let mut response = json!({
        "description": format!("A problem: {}", links.join(", ")),
        "content": {PROBLEM: {"schema": {"$ref": "#/components/schemas/Problem"}}},
    });
    if kinds.iter().any(|kind| kind.retry_after().is_some()) {
        response["headers"]["Retry-After"] = json!({
            "description": "Seconds after which trying again makes sense, with 429 and 503.",
            "schema": {"type": "integer", "format": "int32"},
        });
    }
    response
}
