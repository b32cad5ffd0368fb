//! Runs the program `bagtrack-eval` on synthetic clips, and the tracker itself on the same clips.

use bagtrack_ingest::{Limits, decode_to};
use bagtrack_sample::{Clip, Format, Settings};
use bagtrack_testing::command;
use bagtrack_tracker::{Estimate, Params, Tracker};
use std::path::{Path, PathBuf};
use std::process::Output;

pub use bagtrack_testing::command::{folder, text};

const PROGRAM: &str = "bagtrack-eval";

/// Runs the program.
pub fn eval(args: &[&str]) -> Output {
    command::run(PROGRAM, args)
}

/// Standard output of the program, which must succeed.
pub fn succeeds(args: &[&str]) -> String {
    command::success(eval(args))
}

/// The one line that the program, which must fail, prints on standard error.
pub fn fails(args: &[&str]) -> String {
    command::failure(PROGRAM, eval(args))
}

/// A small sample clip of `frames` frames in the folder `name` under `parent`.
pub fn clip(parent: &Path, name: &str, seed: u64, frames: u32) -> PathBuf {
    let dir = parent.join(name);
    let settings = Settings {
        frames,
        seed,
        ..Settings::default()
    };
    let clip = Clip::new(settings).expect("the settings are in order");
    let written = clip.write(&dir, Format::Jpeg, || ());
    written.expect("the folder is writable");
    dir
}

/// The tracker's answers to the frames of a clip after the first, from the box `first` on.
pub fn tracked(dir: &Path, first: bagtrack_tracker::Rect, params: Params) -> Vec<Estimate> {
    let frames = bagtrack_cli::frames::list(dir).expect("the clip has frames");
    let limits = Limits::default();
    let read = |path: &PathBuf| std::fs::read(path).expect("a frame can be read");
    let format = |size| params.frame_format(size, &first);
    let frame = |path| decode_to(&read(path), &limits, &format).expect("a frame can be decoded");
    let mut tracker =
        Tracker::new(&frame(&frames[0]), first, params.clone()).expect("the box is in the frame");
    let mut answers = vec![tracker.estimate()];
    for path in &frames[1..] {
        answers.push(tracker.step(&frame(path)).expect("frames of one size"));
    }
    answers
}
