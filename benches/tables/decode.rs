//! The time of decoding image files, compared with a step of the tracker.

use std::hint::black_box;

use bagtrack_ingest::{IngestError, Limits};
use bagtrack_tracker::{Frame, Preset, Rect, Tracker};

use crate::clock;

const ROUNDS: usize = 40;

fn read(file: &str) -> Vec<u8> {
    std::fs::read(file).unwrap_or_else(|error| {
        eprintln!("tables: {file}: {error}");
        std::process::exit(2);
    })
}

/// Prints two lines for each file, for a large target and for one of 24 x 24 pixels: the size of the picture, the
/// working size, milliseconds to decode the file to that, milliseconds of a step on it.
pub fn print(files: &[&str]) {
    println!("file\twidth\theight\tworking_width\tworking_height\tdecode_ms\tstep_ms");
    for file in files {
        let bytes = read(file);
        let whole = decoded(bagtrack_ingest::decode(&bytes, &Limits::default()), file);
        let (width, height) = whole.source_size();
        let (w, h) = (f64::from(width), f64::from(height));
        let large = Rect::new(w * 0.4, h * 0.4, w / 6.0, h / 6.0);
        for target in [large, Rect::centered(w / 2.0, h / 2.0, 24.0, 24.0)] {
            print_target(file, &bytes, target);
        }
    }
}

fn decoded(frame: Result<Frame, IngestError>, file: &str) -> Frame {
    frame.unwrap_or_else(|error| {
        eprintln!("tables: {file}: {error}");
        std::process::exit(2);
    })
}

fn print_target(file: &str, bytes: &[u8], target: Rect) {
    let limits = Limits::default();
    let params = Preset::default().params();
    let format = |source| params.frame_format(source, &target);
    let decode = || {
        decoded(
            bagtrack_ingest::decode_to(black_box(bytes), &limits, &format),
            file,
        )
    };
    let frame = decode();
    let ((width, height), size) = (frame.source_size(), (frame.width(), frame.height()));
    let mut tracker = Tracker::new(&frame, target, params.clone()).expect("a box inside the frame");
    for _ in 0..60 {
        tracker.step(&frame).expect("the same frame");
    }
    let times = clock::medians(
        ROUNDS,
        vec![
            Box::new(|| bagtrack_ingest::recycle(black_box(decode()))),
            Box::new(|| {
                black_box(tracker.step(&frame)).expect("the same frame");
            }),
        ],
    );
    println!(
        "{file}\t{width}\t{height}\t{}\t{}\t{:.3}\t{:.3}",
        size.0,
        size.1,
        times[0] * 1e3,
        times[1] * 1e3
    );
}
