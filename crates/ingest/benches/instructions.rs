//! Pieces of work, done a given number of times, for `tools/count_instructions.sh`:
//!
//! - `fill PRESET FILE`: writes a tracker whose bag is full. Under callgrind that would take minutes.
//! - `step FILE COUNT`: up to 16 steps of this tracker, on gray frames of 320 x 240.
//! - `draw ZOOM FILE`: writes a JPEG of 320 x 240 times ZOOM, in colour.
//! - `decode FILE COUNT`: decoding this JPEG.

use bagtrack_ingest::{Limits, decode, recycle};
use bagtrack_testing::{bench_pictures as pictures, bench_scene as scene};
use bagtrack_tracker::{Preset, Tracker};
use std::hint::black_box;

const MOST_STEPS: usize = 16;

fn main() {
    // Cargo adds `--bench`.
    let arguments: Vec<String> = std::env::args().filter(|text| text != "--bench").collect();
    let arguments: Vec<&str> = arguments.iter().skip(1).map(String::as_str).collect();
    match arguments[..] {
        ["fill", "paper", file] => fill(Preset::Paper, file),
        ["fill", "robust", file] => fill(Preset::Robust, file),
        ["step", file, count] => step(file, number(count)),
        ["draw", zoom, file] => draw(number(zoom), file),
        ["decode", file, count] => repeat_decode(file, number(count)),
        _ => {
            eprintln!(
                "instructions: fill PRESET FILE | step FILE COUNT | draw ZOOM FILE | decode FILE COUNT"
            );
            std::process::exit(2);
        }
    }
}

fn number(argument: &str) -> usize {
    argument.parse().unwrap_or_else(|error| {
        eprintln!("instructions: {argument}: {error}");
        std::process::exit(2);
    })
}

fn fill(preset: Preset, file: &str) {
    let tracker = scene::warm(&scene::frames(), preset.params());
    std::fs::write(file, tracker.snapshot()).expect("a file that can be written");
}

fn step(file: &str, count: usize) {
    let saved = std::fs::read(file).expect("a file that `fill` wrote");
    let mut tracker = Tracker::restore(&saved).expect("a tracker that `fill` wrote");
    // The same number of frames for each count, so that drawing them cancels out in the difference.
    let frames: Vec<_> = (1..=MOST_STEPS).map(scene::frame).collect();
    for frame in &frames[..count] {
        tracker.step(frame).expect("frames of one size");
    }
    black_box(tracker.estimate());
}

fn draw(zoom: usize, file: &str) {
    let jpegs = pictures::jpegs(zoom).expect("pictures of a size that JPEG has");
    std::fs::write(file, &jpegs[0]).expect("a file that can be written");
}

fn repeat_decode(file: &str, count: usize) {
    let jpeg = std::fs::read(file).expect("a file that `draw` wrote");
    for _ in 0..count {
        let frame = decode(black_box(&jpeg), &Limits::default());
        recycle(black_box(frame.expect("a JPEG of our own")));
    }
}
