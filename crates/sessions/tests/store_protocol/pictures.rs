//! The frames that a client and its rival send, and the boxes that each history of them has.

use crate::common::{self, FIRST};
use bagtrack_ingest::{Limits, decode_to};
use bagtrack_sessions::Estimates;
use bagtrack_testing::pictures::{encode, scene_at};
use bagtrack_tracker::{Frame, Params, Tracker};
use image::ImageFormat;
use std::collections::HashMap;
use std::sync::{Mutex, OnceLock};

/// The last frame that is sent.
pub const FRAMES: u64 = 6;

/// Who sent each frame after the first: the client (0) or its rival (1).
pub type History = Vec<u8>;

/// Frame `number` as this sender sends it. In the rival's frames the target moves differently.
pub fn picture(sender: u8, number: u64) -> Vec<u8> {
    let number = number as u32;
    let (left, top) = match sender {
        0 => (20 + 2 * number, 15 + number),
        _ => (21 + number, 15 + 2 * number),
    };
    encode(scene_at(left, top), ImageFormat::Png)
}

pub fn params(seed: u64) -> Params {
    Params {
        seed,
        ..common::params()
    }
}

fn frame(sender: u8, number: u64) -> Frame {
    let format = |source| params(0).frame_format(source, &FIRST);
    decode_to(&picture(sender, number), &Limits::default(), &format).unwrap()
}

/// The trackers by the seeds of their sessions and by their histories.
type Trackers = HashMap<(u64, History), Tracker>;

fn tracker(known: &mut Trackers, seed: u64, history: &[u8]) -> Tracker {
    let key = (seed, history.to_vec());
    if let Some(tracker) = known.get(&key) {
        return tracker.clone();
    }
    let tracked = match history.split_last() {
        None => Tracker::new(&frame(0, 0), FIRST, params(seed)).unwrap(),
        Some((&sender, before)) => {
            let mut tracker = tracker(known, seed, before);
            let _ = tracker.step(&frame(sender, history.len() as u64)).unwrap();
            tracker
        }
    };
    known.insert(key, tracked.clone());
    tracked
}

/// The histories whose last frame has this answer: mostly one.
pub fn histories(seed: u64, answer: &Estimates) -> Vec<History> {
    static KNOWN: OnceLock<Mutex<Trackers>> = OnceLock::new();
    let mut known = KNOWN.get_or_init(Mutex::default).lock().unwrap();
    let length = answer.first().frame as u32;
    let all = (0..2_u32.pow(length)).map(|senders| {
        let senders = (0..length).map(|at| (senders >> at & 1) as u8);
        senders.collect::<History>()
    });
    let mut answers_so = |history: &History| {
        let tracker = tracker(&mut known, seed, history);
        Estimates::One(tracker.estimate()) == *answer
    };
    all.filter(|history| answers_so(history)).collect()
}
