//! The answer to a frame.

use bagtrack_tracker::{Diagnostics, Estimate, Rect, Status};
use wasm_bindgen::prelude::*;

/// The most particles in a [`WasmSeen`]: the likeliest ones.
const MOST_PARTICLES: usize = 200;

/// The answer to a frame.
#[wasm_bindgen(js_name = Estimate, getter_with_clone)]
#[derive(Debug, Clone, Copy)]
pub struct WasmEstimate {
    /// The number of the frame; that of the first is 0.
    pub frame: f64,
    /// The left edge of the box, in pixels of the frame.
    pub x: f64,
    /// The upper edge of the box.
    pub y: f64,
    /// The width of the box.
    pub width: f64,
    /// The height of the box.
    pub height: f64,
    /// The chance that the box overlaps the target by half or more.
    pub score: f32,
    status: Status,
}

#[wasm_bindgen(js_class = Estimate)]
impl WasmEstimate {
    /// `tracking`, `uncertain` or `lost`.
    #[wasm_bindgen(getter)]
    pub fn status(&self) -> String {
        match self.status {
            Status::Tracking => "tracking",
            Status::Uncertain => "uncertain",
            Status::Lost => "lost",
        }
        .to_owned()
    }
}

impl From<Estimate> for WasmEstimate {
    fn from(estimate: Estimate) -> Self {
        let Rect {
            x,
            y,
            width,
            height,
        } = estimate.target;
        Self {
            // Frame numbers are below 2^53.
            frame: estimate.frame as f64,
            x,
            y,
            width,
            height,
            score: estimate.score,
            status: estimate.status,
        }
    }
}

/// What the answer to a frame was chosen from.
#[wasm_bindgen(js_name = Seen, getter_with_clone)]
#[derive(Debug, Clone)]
pub struct WasmSeen {
    /// The answer.
    pub estimate: WasmEstimate,
    /// For each of the likeliest particles its centre x and y, its width and its weight; the likeliest first.
    pub particles: Vec<f64>,
    /// For each entry of the bag, oldest first, its share of the vote for the answer.
    pub votes: Vec<f64>,
}

impl WasmSeen {
    pub(crate) fn new(estimate: Estimate, seen: Diagnostics) -> Self {
        let mut particles = seen.particles;
        particles.sort_by(|a, b| b.1.total_cmp(&a.1));
        particles.truncate(MOST_PARTICLES);
        let flat = particles.iter().flat_map(|(area, weight)| {
            let (x, y) = (area.x + area.width / 2.0, area.y + area.height / 2.0);
            [x, y, area.width, *weight]
        });
        Self {
            estimate: estimate.into(),
            particles: flat.collect(),
            votes: seen.votes,
        }
    }
}
