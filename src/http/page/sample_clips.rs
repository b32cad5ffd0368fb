//! `/sample/{clip}/…`: the synthetic clips of the page, drawn when they are asked for.
//!
//! Each frame is drawn at its first request, one frame of a clip at a time, and kept: this bounds the cost of the clips
//! however often they are asked for. A clip's first frame takes up to a second, since the background is drawn with it.
//! So the first frames are drawn ahead when somebody opens the page.

use crate::http::problems::problem::Problem;
use crate::http::respond::body::Json;
use axum::body::Bytes;
use axum::extract::Path;
use axum::extract::rejection::PathRejection;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE};
use axum::response::{IntoResponse, Response};
use bagtrack_sample::{Clip, Format, Scene, Settings};
use image::ImageResult;
use serde::Serialize;
use std::sync::{Arc, LazyLock, Once, OnceLock};
use std::thread;
use tokio::sync::Mutex;

const FRAMES: u32 = 150;
const SIZE: (u32, u32) = (480, 360);
/// Browsers may keep the clips for an hour: they are always the same.
const CACHED: &str = "public, max-age=3600";

/// A clip and the files of its frames.
struct Drawn {
    name: &'static str,
    clip: Arc<Clip>,
    frames: Vec<OnceLock<Bytes>>,
    drawing: Mutex<()>,
}

static CLIPS: LazyLock<[Drawn; 2]> = LazyLock::new(|| {
    [
        Drawn::new("card", Scene::Default),
        Drawn::new("leaves", Scene::Leaves),
    ]
});

/// What a clip is: its size, and where the target is in each frame.
#[derive(Debug, Serialize)]
pub struct ClipView {
    width: u32,
    height: u32,
    /// For each frame `x, y, width, height` of the target in pixels, and the share of it that is seen, from 0 to 1.
    truth: Vec<[f64; 5]>,
}

impl Drawn {
    fn new(name: &'static str, scene: Scene) -> Self {
        let settings = Settings {
            scene,
            frames: FRAMES,
            width: SIZE.0,
            height: SIZE.1,
            ..Settings::default()
        };
        Self {
            name,
            clip: Arc::new(Clip::new(settings).expect("the settings are in their ranges")),
            frames: (0..FRAMES).map(|_| OnceLock::new()).collect(),
            drawing: Mutex::new(()),
        }
    }

    async fn frame(&self, index: u32) -> Result<Bytes, Problem> {
        let frame = &self.frames[index as usize];
        let _drawing = match frame.get() {
            Some(bytes) => return Ok(bytes.clone()),
            None => self.drawing.lock().await,
        };
        if let Some(bytes) = frame.get() {
            return Ok(bytes.clone());
        }
        let clip = self.clip.clone();
        let draw = move || encode(&clip, index);
        let drawn = tokio::task::spawn_blocking(draw).await;
        let drawn = drawn.map_err(|_| Problem::panicked())?;
        let bytes = drawn.map_err(|error| Problem::internal(Arc::new(error)))?;
        Ok(frame.get_or_init(|| bytes.into()).clone())
    }

    /// Draws the first frame. Requests for frames of this clip wait meanwhile.
    fn draw_first(&self) {
        let _drawing = self.drawing.blocking_lock();
        // An error is dropped here: the next request for the frame draws again, and gets the error.
        if let Ok(bytes) = encode(&self.clip, 0) {
            self.frames[0].get_or_init(|| bytes.into());
        }
    }
}

fn encode(clip: &Clip, index: u32) -> ImageResult<Vec<u8>> {
    Format::Jpeg.encode(&clip.draw(index))
}

/// Draws the clips' first frames in the background, once. No service waits for the thread, at its start or at its end.
pub fn draw_ahead() {
    static BEGUN: Once = Once::new();
    BEGUN.call_once(|| {
        let draw = || CLIPS.iter().for_each(Drawn::draw_first);
        // Without the thread each frame is drawn at its first request.
        let _ = thread::Builder::new()
            .name("sample-clips".to_owned())
            .spawn(draw);
    });
}

fn find(name: &str) -> Result<&'static Drawn, Problem> {
    let found = CLIPS.iter().find(|clip| clip.name == name);
    found.ok_or_else(Problem::route_not_found)
}

/// `/sample/{clip}/clip.json`.
pub async fn view(path: Result<Path<String>, PathRejection>) -> Result<Response, Problem> {
    let Path(name) = path.map_err(|_| Problem::route_not_found())?;
    let clip = &find(&name)?.clip;
    let truth = (0..FRAMES).map(|index| {
        let target = clip.target(index);
        let values = [
            target.x,
            target.y,
            target.width,
            target.height,
            clip.visible(index),
        ];
        values.map(|value| (value * 1000.0).round() / 1000.0)
    });
    let view = ClipView {
        width: SIZE.0,
        height: SIZE.1,
        truth: truth.collect(),
    };
    Ok(([(CACHE_CONTROL, CACHED)], Json(view)).into_response())
}

/// `/sample/{clip}/{frame}`: `0.jpg` and so on.
pub async fn frame(
    path: Result<Path<(String, String)>, PathRejection>,
) -> Result<Response, Problem> {
    let Path((name, file)) = path.map_err(|_| Problem::route_not_found())?;
    let index = file
        .strip_suffix(".jpg")
        .and_then(|number| number.parse().ok());
    let index = index.filter(|index| *index < FRAMES);
    let index = index.ok_or_else(Problem::route_not_found)?;
    let bytes = find(&name)?.frame(index).await?;
    let headers = [(CONTENT_TYPE, "image/jpeg"), (CACHE_CONTROL, CACHED)];
    Ok((headers, bytes).into_response())
}
