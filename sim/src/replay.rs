//! The tracker alone: what the answers to the frames of a session must be.

use crate::scenes;
use bagtrack_client::{OpenOptions, Rect};
use bagtrack_ingest::Limits;
use bagtrack_tracker::{Estimate, Frame, Params, Preset, Status, Tracker};
use std::cell::RefCell;
use std::collections::HashMap;

/// What a session is opened with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Opening {
    /// The clip whose pictures the session is sent.
    pub clip: usize,
    pub seed: u64,
}

/// A frame of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Sent {
    /// Which picture of the clip it is.
    pub picture: usize,
    /// Whether the caller corrects the box: to where the target is.
    pub is_correction: bool,
}

/// The parameters in which sessions differ from the preset, to be quick.
const PARAMETERS: [(&str, u32); 7] = [
    ("particles", 8),
    ("patch_width", 4),
    ("patch_height", 4),
    ("basis_dim", 1),
    ("history", 2),
    ("bag_size", 2),
    ("update_every", 2),
];

pub fn options(opening: Opening) -> OpenOptions {
    let options = OpenOptions::new()
        .preset(bagtrack_client::Preset::Paper)
        .seed(opening.seed);
    PARAMETERS.iter().fold(options, |options, (name, value)| {
        options.parameter(name, *value)
    })
}

fn params(opening: Opening) -> Params {
    let mut params = Preset::Paper.params();
    params.seed = opening.seed;
    for (name, value) in PARAMETERS {
        params
            .set(name, f64::from(value))
            .expect("a parameter of the table");
    }
    params
}

/// The answers, by what a session was opened with and its frames.
type Known = HashMap<(Opening, Vec<Sent>), Vec<String>>;

thread_local! {
    /// The answers that were computed before: many runs send the same frames.
    static KNOWN: RefCell<Known> = RefCell::default();
}

/// The tracker's answers to the frames of a session, including the first.
pub fn answers(opening: Opening, frames: &[Sent]) -> Vec<String> {
    let key = (opening, frames.to_vec());
    if let Some(known) = KNOWN.with_borrow(|known| known.get(&key).cloned()) {
        return known;
    }
    let answers = track(opening, frames);
    KNOWN.with_borrow_mut(|known| known.insert(key, answers.clone()));
    answers
}

fn track(opening: Opening, frames: &[Sent]) -> Vec<String> {
    let (params, clip) = (params(opening), opening.clip);
    let target = |picture| scenes::target(clip, picture);
    let first = decoded(clip, frames[0].picture, &params);
    let mut tracker = Tracker::new(&first, target(frames[0].picture), params.clone())
        .expect("the first picture can be followed");
    let mut answers = vec![told(&tracker.estimate())];
    for frame in &frames[1..] {
        let picture = decoded(clip, frame.picture, &params);
        let estimate = match frame.is_correction {
            true => tracker.retarget(&picture, target(frame.picture)),
            false => tracker.step(&picture),
        };
        answers.push(told(&estimate.expect("all pictures have one size")));
    }
    answers
}

fn decoded(clip: usize, picture: usize, params: &Params) -> Frame {
    let format = |size| params.frame_format(size, &scenes::target(clip, 0));
    bagtrack_ingest::decode_to(&scenes::picture(clip, picture), &Limits::default(), &format)
        .expect("it was encoded here")
}

/// An answer as the service rounds it: boxes to a hundredth of a pixel, scores to a thousandth.
fn told(estimate: &Estimate) -> String {
    let target = estimate.target;
    let rect = Rect::from([target.x, target.y, target.width, target.height]).rounded();
    let score = (f64::from(estimate.score) * 1000.0).round() / 1000.0;
    let status = match estimate.status {
        Status::Tracking => "tracking",
        Status::Uncertain => "uncertain",
        Status::Lost => "lost",
    };
    text(rect, score, status)
}

/// An answer (box, score and status) in one line.
pub fn text(rect: Rect, score: f64, status: &str) -> String {
    format!("{rect} {score:.3} {status}")
}
