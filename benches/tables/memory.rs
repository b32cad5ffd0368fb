//! Resident memory of live trackers.

use bagtrack_testing::memory;
use bagtrack_tracker::{Preset, Tracker};

use crate::{scene, warm};

fn resident() -> u64 {
    memory::of_process(std::process::id(), "VmRSS:").unwrap_or(0)
}

/// Prints the resident memory of up to `count` trackers with full bags, all of one preset. Memory
/// freed by another preset would be reused and not counted.
pub fn print(preset: Preset, count: usize) {
    println!("| live | resident MiB | KiB each |");
    println!("|---|---|---|");
    let (mut first, frames) = warm(preset.params());
    let before = resident();
    let mut trackers: Vec<Tracker> = Vec::with_capacity(count);
    for live in 1..=count {
        first
            .step(&frames[live % scene::ROUND])
            .expect("frames of one size");
        trackers.push(first.clone());
        if live == count || (live.is_power_of_two() && live >= count / 16) {
            let bytes = resident().saturating_sub(before);
            let (mib, each) = (bytes >> 20, bytes as f64 / 1024.0 / live as f64);
            println!("| {live} | {mib} | {each:.0} |");
        }
    }
}
