//! `/`: the page for people, with its style sheet and its scripts. All of it is in the program.
//!
//! Browsers ask again each time, and get 304 as long as the program is the same.

use super::static_file::StaticFile;
use crate::http::extract::instance::Instance;
use crate::http::middleware::response_headers::PAGE_POLICY;
use crate::http::page::sample_clips;
use crate::http::problems::problem::Problem;
use axum::body::Bytes;
use axum::extract::Path;
use axum::extract::rejection::PathRejection;
use axum::http::HeaderMap;
use axum::response::{IntoResponse, Redirect, Response};
use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock};

const INDEX: &str = "index.html";

/// A file of the page: its name and bytes.
type File = (&'static str, &'static [u8]);

/// Embeds the named files of a folder of this repository.
macro_rules! files {
    ($folder:literal: $($name:literal),+) => {
        &[$(($name, include_bytes!(concat!("../../../", $folder, $name)))),+]
    };
}

const FILES: &[File] = files!["web/":
    "index.html", "page.css", "main.js", "again.js", "begin.js", "box.js", "boxes.js", "camera.js", "clip.js",
    "decoded.js", "decoder.js", "delivery.js", "dom.js", "drawn.js", "editing.js", "file.js", "follower.js",
    "frames.js", "gaps.js", "handover.js", "images.js", "indexer.js", "keeping.js", "kept.js", "keys.js", "list.js",
    "matroska.js", "message.js", "objects.js", "opening.js", "page.js", "particles.js", "playback.js", "player.js",
    "problems.js", "project.js", "recording.js", "run.js", "save.js", "saving.js", "scene.js", "search.js",
    "seen.js", "source.js", "sources.js", "stage.js", "stills.js", "timeline.js", "undo.js", "video.js", "votes.js",
    "welcome-rows.js", "welcome.js", "zip.js", "wasm/bagtrack_demux.js", "wasm/bagtrack_demux_bg.wasm"
];

/// The JavaScript client, which the page uses.
const CLIENT: &[File] = files!["clients/":
    "js/backoff.js", "js/bag.js", "js/bagtrack.js", "js/client.js", "js/given.js", "js/image.js", "js/kept.js",
    "js/local.js", "js/module.js", "js/platform.js", "js/problem.js", "js/session.js", "js/snapshot.js",
    "js/stream.js", "js/tracker.js", "js/transfer.js", "js/transport.js", "js/worker.js",
    "js/wasm/bagtrack_wasm.js", "js/wasm/bagtrack_wasm_bg.wasm"
];

/// The files of [`FILES`] and [`CLIENT`], by their names.
static SERVED: LazyLock<BTreeMap<&str, Arc<StaticFile>>> = LazyLock::new(|| {
    let served = FILES.iter().chain(CLIENT).map(|(name, bytes)| {
        let bytes = Bytes::from_static(bytes);
        let file = StaticFile::new(media_type(name), PAGE_POLICY, "no-cache", bytes);
        (*name, file)
    });
    served.collect()
});

fn media_type(name: &str) -> &'static str {
    match name.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("wasm") => "application/wasm",
        _ => "text/javascript; charset=utf-8",
    }
}

/// `/`. The page's links are relative, so a request for a base path without the slash at its end is redirected.
pub async fn index(instance: Instance, headers: HeaderMap) -> Response {
    sample_clips::draw_ahead();
    match instance.path.ends_with('/') {
        true => SERVED[INDEX].respond(&headers).await,
        false => Redirect::permanent("/").into_response(),
    }
}

/// `/page/{*file}`.
pub async fn asset(
    path: Result<Path<String>, PathRejection>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let Path(path) = path.map_err(|_| Problem::route_not_found())?;
    let file = SERVED.get(&*path).filter(|_| path != INDEX);
    let file = file.ok_or_else(Problem::route_not_found)?;
    Ok(file.respond(&headers).await)
}
