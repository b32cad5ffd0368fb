//! The time to save a tracker's state as bytes, and to restore it.

use std::hint::black_box;

use bagtrack_tracker::{Preset, Tracker};

use crate::{clock, scene, warm};

const ROUNDS: usize = 300;
/// How many frames behind the copy is that a state is restored beside.
const BEHIND: usize = 3;

pub fn print() {
    let (mut tracker, frames) = warm(Preset::Robust.params());
    let behind = tracker.clone();
    for t in 1..=BEHIND {
        tracker
            .step(&frames[t % scene::ROUND])
            .expect("frames of one size");
    }
    let bytes = tracker.snapshot();
    let times = clock::medians(
        ROUNDS,
        vec![
            Box::new(|| {
                black_box(tracker.snapshot());
            }),
            Box::new(|| {
                black_box(Tracker::restore(black_box(&bytes))).expect("its own snapshot");
            }),
            Box::new(|| {
                black_box(behind.restore_near(black_box(&bytes), None)).expect("its own snapshot");
            }),
        ],
    );
    println!("median of {ROUNDS} rounds, in turns, processor time of one thread\n");
    println!("| `robust`, {} bytes | µs |", bytes.len());
    println!("|---|---:|");
    let near = format!("restore, beside a copy {BEHIND} frames behind");
    for (what, seconds) in ["snapshot", "restore", &near].iter().zip(times) {
        println!("| {what} | {:.0} |", seconds * 1e6);
    }
}
