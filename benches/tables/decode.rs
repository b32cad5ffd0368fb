//! Decoding files against a step.

use std::hint::black_box;

use bagtrack::ingest::{self, Limits};
use bagtrack::tracker::{Preset, Rect, Tracker};

use crate::clock;

const ROUNDS: usize = 40;

fn read(file: &str) -> Vec<u8> {
    std::fs::read(file).unwrap_or_else(|error| {
        eprintln!("tables: {file}: {error}");
        std::process::exit(2);
    })
}

/// Prints a line for each file: its size, milliseconds to decode it to a working image, milliseconds of a step on that.
pub fn print(files: &[&str]) {
    println!("file\twidth\theight\tdecode_ms\tstep_ms");
    for file in files {
        let bytes = read(file);
        let limits = Limits::default();
        let frame = ingest::decode(&bytes, &limits).unwrap_or_else(|error| {
            eprintln!("tables: {file}: {error}");
            std::process::exit(2);
        });
        let (width, height) = frame.source_size();
        let (w, h) = (f64::from(width), f64::from(height));
        let target = Rect::new(w * 0.4, h * 0.4, w * 0.2, h * 0.2);
        let mut tracker = Tracker::new(&frame, target, Preset::default().params())
            .expect("a box inside the frame");
        for _ in 0..60 {
            tracker.step(&frame).expect("the same frame");
        }
        let times = clock::medians(
            ROUNDS,
            vec![
                Box::new(|| {
                    black_box(ingest::decode(black_box(&bytes), &limits)).expect("decoded before");
                }),
                Box::new(|| {
                    black_box(tracker.step(&frame)).expect("the same frame");
                }),
            ],
        );
        println!(
            "{file}\t{width}\t{height}\t{:.3}\t{:.3}",
            times[0] * 1e3,
            times[1] * 1e3
        );
    }
}

/// Decodes `file` `count` times.
pub fn repeat(count: usize, file: &str) {
    let bytes = read(file);
    for _ in 0..count {
        black_box(ingest::decode(black_box(&bytes), &Limits::default())).unwrap_or_else(|error| {
            eprintln!("tables: {file}: {error}");
            std::process::exit(2);
        });
    }
}
