//! The sample clip, and the library's answers to it.

use bagtrack_client::Answer;
use bagtrack_ingest::Limits;
use bagtrack_sample::{Clip as Sample, Format, Settings};
use bagtrack_tracker::{Estimate, Preset, Rect, Status, Tracker};
use serde_json::{Value, json};
use std::sync::LazyLock;

/// The first frame, and a hundred frames to track.
const FRAMES: u32 = 101;

/// Files of frames, and the box in the first.
pub struct Clip {
    pub frames: Vec<Vec<u8>>,
    pub target: Rect,
}

/// Drawn once.
pub static CLIP: LazyLock<Clip> = LazyLock::new(|| {
    let sample = Sample::new(Settings::default()).expect("the settings are in order");
    let encode = |index| Format::Jpeg.encode(&sample.draw(index)).unwrap();
    Clip {
        frames: (0..FRAMES).map(encode).collect(),
        target: sample.target(0),
    }
});

impl Clip {
    /// The box in the first frame.
    pub fn rect(&self) -> bagtrack_client::Rect {
        let Rect { x, y, .. } = self.target;
        [x, y, self.target.width, self.target.height].into()
    }

    /// The library's answers to these frames after the first one, as the service writes them.
    pub fn tracked(&self, seed: u64, frames: &[Vec<u8>]) -> Vec<Value> {
        let decode = |file: &Vec<u8>| bagtrack_ingest::decode(file, &Limits::default()).unwrap();
        let mut params = Preset::Robust.params();
        params.seed = seed;
        let mut tracker = Tracker::new(&decode(&self.frames[0]), self.target, params).unwrap();
        let step = |file| as_answered(&tracker.step(&decode(file)).unwrap());
        frames.iter().map(step).collect()
    }
}

/// An estimate as the service writes it: boxes to 0.01 px, scores to 0.001.
fn as_answered(estimate: &Estimate) -> Value {
    let round = |value: f64| (value * 100.0).round() / 100.0 + 0.0;
    let target = estimate.target;
    json!({
        "frame": estimate.frame,
        "box": {
            "x": round(target.x),
            "y": round(target.y),
            "width": round(target.width),
            "height": round(target.height),
        },
        "score": (f64::from(estimate.score) * 1000.0).round() / 1000.0,
        "status": match estimate.status {
            Status::Tracking => "tracking",
            Status::Uncertain => "uncertain",
            Status::Lost => "lost",
        },
    })
}

/// An answer of the client in the service's JSON form.
pub fn written(answer: &Answer) -> Value {
    serde_json::to_value(answer).unwrap()
}
