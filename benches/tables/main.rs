//! The tables of docs/laboratory/PERFORMANCE.md: `cargo bench --bench tables -- <table>`, one of
//!
//! - `ratios`: a step of each preset, the textbook version, one bare matrix product, in turns in one run;
//! - `growth`: the time of a step against N, H, K, P and more, and of what comes before it against the frame's size;
//! - `decode FILE...`: decoding each file against a step;
//! - `state`: a tracker's state as bytes, and back, alone and beside a copy some frames behind;
//! - `memory PRESET COUNT`: resident memory of so many live trackers.

mod decode;
mod growth;
mod memory;
mod ratios;
mod state;

use bagtrack_testing::{bench_scene as scene, cpu_time as clock, textbook};
use bagtrack_tracker::{Params, Preset, Tracker};

/// A tracker of the scene with a full history and a full bag, and its frames.
fn warm(params: Params) -> (Tracker, Vec<bagtrack_tracker::Frame>) {
    let frames = scene::frames();
    (scene::warm(&frames, params), frames)
}

fn main() {
    // Cargo adds the argument `--bench`.
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|argument| argument != "--bench")
        .collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments[..] {
        ["ratios"] => ratios::print(),
        ["growth"] => growth::print(),
        ["state"] => state::print(),
        ["decode", ref files @ ..] if !files.is_empty() => decode::print(files),
        ["memory", "paper", count] => memory::print(Preset::Paper, number(count)),
        ["memory", "robust", count] => memory::print(Preset::Robust, number(count)),
        // `cargo bench` and `cargo test --benches` start this program without naming a table.
        [] => ratios::print(),
        _ => {
            eprintln!("tables: ratios | growth | decode FILE... | state | memory PRESET COUNT");
            std::process::exit(2);
        }
    }
}

fn number(argument: &str) -> usize {
    argument.parse().unwrap_or_else(|error| {
        eprintln!("tables: {argument}: {error}");
        std::process::exit(2);
    })
}
