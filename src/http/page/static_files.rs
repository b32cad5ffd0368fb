//! `/`: the page for people, with its style sheet and its scripts. All of it is in the program.
//!
//! Browsers ask again each time, and get 304 as long as the program is the same.

use super::static_file::StaticFile;
use crate::http::extract::instance::Instance;
use crate::http::middleware::security_headers::PAGE_POLICY;
use crate::http::page::sample_clips;
use crate::http::problems::problem::Problem;
use axum::body::Bytes;
use axum::extract::Path;
use axum::extract::rejection::PathRejection;
use axum::http::HeaderMap;
use axum::response::{IntoResponse, Redirect, Response};
use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock};

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const WASM: &str = "application/wasm";

/// A file of the page: its name, media type and bytes.
type File = (&'static str, &'static str, &'static [u8]);

macro_rules! file {
    ($name:literal, $media_type:ident) => {
        (
            $name,
            $media_type,
            include_bytes!(concat!("../../../web/", $name)),
        )
    };
}

/// A file of the JavaScript client, which the page uses.
macro_rules! client_file {
    ($name:literal) => {
        client_file!($name, SCRIPT)
    };
    ($name:literal, $media_type:ident) => {
        (
            $name,
            $media_type,
            include_bytes!(concat!("../../../clients/", $name)),
        )
    };
}

const INDEX: File = file!("index.html", HTML);

const FILES: [File; 75] = [
    file!("page.css", CSS),
    file!("main.js", SCRIPT),
    file!("again.js", SCRIPT),
    file!("begin.js", SCRIPT),
    file!("box.js", SCRIPT),
    file!("boxes.js", SCRIPT),
    file!("camera.js", SCRIPT),
    file!("clip.js", SCRIPT),
    file!("decoded.js", SCRIPT),
    file!("decoder.js", SCRIPT),
    file!("delivery.js", SCRIPT),
    file!("dom.js", SCRIPT),
    file!("drawn.js", SCRIPT),
    file!("editing.js", SCRIPT),
    file!("file.js", SCRIPT),
    file!("follower.js", SCRIPT),
    file!("frames.js", SCRIPT),
    file!("gaps.js", SCRIPT),
    file!("handover.js", SCRIPT),
    file!("images.js", SCRIPT),
    file!("indexer.js", SCRIPT),
    file!("keeping.js", SCRIPT),
    file!("kept.js", SCRIPT),
    file!("keys.js", SCRIPT),
    file!("list.js", SCRIPT),
    file!("matroska.js", SCRIPT),
    file!("message.js", SCRIPT),
    file!("objects.js", SCRIPT),
    file!("opening.js", SCRIPT),
    file!("page.js", SCRIPT),
    file!("particles.js", SCRIPT),
    file!("playback.js", SCRIPT),
    file!("player.js", SCRIPT),
    file!("problems.js", SCRIPT),
    file!("project.js", SCRIPT),
    file!("recording.js", SCRIPT),
    file!("run.js", SCRIPT),
    file!("save.js", SCRIPT),
    file!("saving.js", SCRIPT),
    file!("scene.js", SCRIPT),
    file!("search.js", SCRIPT),
    file!("seen.js", SCRIPT),
    file!("source.js", SCRIPT),
    file!("sources.js", SCRIPT),
    file!("stage.js", SCRIPT),
    file!("stills.js", SCRIPT),
    file!("timeline.js", SCRIPT),
    file!("undo.js", SCRIPT),
    file!("video.js", SCRIPT),
    file!("votes.js", SCRIPT),
    file!("welcome-rows.js", SCRIPT),
    file!("welcome.js", SCRIPT),
    file!("zip.js", SCRIPT),
    file!("wasm/bagtrack_demux.js", SCRIPT),
    file!("wasm/bagtrack_demux_bg.wasm", WASM),
    client_file!("js/backoff.js"),
    client_file!("js/bag.js"),
    client_file!("js/bagtrack.js"),
    client_file!("js/client.js"),
    client_file!("js/given.js"),
    client_file!("js/image.js"),
    client_file!("js/kept.js"),
    client_file!("js/local.js"),
    client_file!("js/module.js"),
    client_file!("js/platform.js"),
    client_file!("js/problem.js"),
    client_file!("js/session.js"),
    client_file!("js/snapshot.js"),
    client_file!("js/stream.js"),
    client_file!("js/tracker.js"),
    client_file!("js/transfer.js"),
    client_file!("js/transport.js"),
    client_file!("js/worker.js"),
    client_file!("js/wasm/bagtrack_wasm.js"),
    client_file!("js/wasm/bagtrack_wasm_bg.wasm", WASM),
];

/// All of them, by their names.
static SERVED: LazyLock<BTreeMap<&str, Arc<StaticFile>>> = LazyLock::new(|| {
    let files = FILES.iter().chain([&INDEX]);
    let served = files.map(|(name, media_type, bytes)| {
        let bytes = Bytes::from_static(bytes);
        let file = StaticFile::new(*media_type, PAGE_POLICY, "no-cache", bytes);
        (*name, file)
    });
    served.collect()
});

/// `/`. Its links are relative, so a base path needs its slash.
pub async fn index(instance: Instance, headers: HeaderMap) -> Response {
    sample_clips::draw_ahead();
    match instance.path.ends_with('/') {
        true => SERVED[INDEX.0].respond(&headers).await,
        false => Redirect::permanent("/").into_response(),
    }
}

/// `/page/{*file}`.
pub async fn asset(
    path: Result<Path<String>, PathRejection>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let Path(path) = path.map_err(|_| Problem::route_not_found())?;
    let file = SERVED.get(&*path).filter(|_| path != INDEX.0);
    let file = file.ok_or_else(Problem::route_not_found)?;
    Ok(file.respond(&headers).await)
}
