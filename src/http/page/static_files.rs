//! `/`: the page for people, with its style sheet and its scripts. All of it is in the program.
//!
//! Browsers ask again each time, and get 304 as long as the program is the same.

use crate::http::middleware::base_path::client_path;
use crate::http::middleware::security_headers::PAGE_POLICY;
use crate::http::problems::problem::Problem;
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, Request};
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, ETAG, IF_NONE_MATCH,
};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Redirect, Response};

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

/// A file of the page: its name, media type and text.
type File = (&'static str, &'static str, &'static str);

macro_rules! file {
    ($name:literal, $media_type:ident) => {
        (
            $name,
            $media_type,
            include_str!(concat!("../../../web/", $name)),
        )
    };
}

/// A file of the JavaScript client, which the page uses.
macro_rules! client_file {
    ($name:literal) => {
        (
            $name,
            SCRIPT,
            include_str!(concat!("../../../clients/", $name)),
        )
    };
}

const INDEX: File = file!("index.html", HTML);

const FILES: [File; 18] = [
    file!("page.css", CSS),
    file!("main.js", SCRIPT),
    file!("box.js", SCRIPT),
    file!("chart.js", SCRIPT),
    file!("clip.js", SCRIPT),
    file!("problems.js", SCRIPT),
    file!("run.js", SCRIPT),
    file!("save.js", SCRIPT),
    file!("stage.js", SCRIPT),
    file!("video.js", SCRIPT),
    client_file!("js/backoff.js"),
    client_file!("js/bagtrack.js"),
    client_file!("js/client.js"),
    client_file!("js/kept.js"),
    client_file!("js/problem.js"),
    client_file!("js/session.js"),
    client_file!("js/stream.js"),
    client_file!("js/transport.js"),
];

/// `/`. Its links are relative, so a base path needs its slash.
pub async fn index(request: Request) -> Response {
    let path = client_path(&request);
    match path.ends_with('/') {
        true => respond(INDEX, request.headers()),
        false => Redirect::permanent("/").into_response(),
    }
}

/// `/page/{*file}`.
pub async fn asset(
    path: Result<Path<String>, PathRejection>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let Path(path) = path.map_err(|_| Problem::route_not_found())?;
    let file = FILES.iter().find(|(name, ..)| *name == path);
    let file = file.ok_or_else(Problem::route_not_found)?;
    Ok(respond(*file, &headers))
}

fn respond((_, media_type, text): File, headers: &HeaderMap) -> Response {
    let tag = format!("\"{:032x}\"", xxhash_rust::xxh3::xxh3_128(text.as_bytes()));
    let known = headers
        .get(IF_NONE_MATCH)
        .and_then(|value| value.to_str().ok());
    let is_known = known.is_some_and(|known| known.contains(&tag));
    let headers = [
        (CONTENT_TYPE, media_type.to_owned()),
        (CONTENT_SECURITY_POLICY, PAGE_POLICY.to_owned()),
        (CACHE_CONTROL, "no-cache".to_owned()),
        (ETAG, tag),
    ];
    match is_known {
        true => (StatusCode::NOT_MODIFIED, headers).into_response(),
        false => (headers, text).into_response(),
    }
}
