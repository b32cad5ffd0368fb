//! The time of a step against each size that it depends on, with the order that is expected.

use std::hint::black_box;

use bagtrack::tracker::{GrayFrame, Params, Preset, Tracker};

use crate::clock::Action;
use crate::{clock, scene, warm};

const ROUNDS: usize = 200;

/// Prints the table.
pub fn print() {
    println!("median of {ROUNDS} steps of preset `paper` but for one size, in turns, one thread\n");
    println!("| size | values | µs | expected |");
    println!("|---|---|---|---|");
    let with = |change: &dyn Fn(&mut Params, u32), value: u32| {
        let mut params = Preset::Paper.params();
        change(&mut params, value);
        params
    };
    let line = |name: &str, values: &[u32], expected: &str, change: &dyn Fn(&mut Params, u32)| {
        let times = steps(values.iter().map(|&value| with(change, value)).collect());
        println!(
            "| {name} | {} | {} | {expected} |",
            row(values),
            micros(&times)
        );
    };
    line("N, particles", &[50, 100, 200, 400, 800], "N", &|p, n| {
        p.particles = n;
    });
    line(
        "H₁ = H₂, D = H₁ H₂",
        &[8, 16, 32, 64],
        "D",
        &|p, side| {
            (p.patch_width, p.patch_height) = (side, side);
        },
    );
    line("K, bag", &[2, 4, 8, 16, 32], "a + K", &|p, k| {
        p.bag_size = k
    });
    line("P, history", &[1, 2, 5, 10], "a + P³", &|p, history| {
        p.history = history;
    });
    frame_sizes();
}

fn row(values: &[u32]) -> String {
    values
        .iter()
        .map(u32::to_string)
        .collect::<Vec<_>>()
        .join(" · ")
}

fn micros(seconds: &[f64]) -> String {
    let texts: Vec<String> = seconds.iter().map(|s| format!("{:.0}", s * 1e6)).collect();
    texts.join(" · ")
}

/// The median time of a step at each of these settings, in turns.
fn steps(settings: Vec<Params>) -> Vec<f64> {
    let mut trackers: Vec<(Tracker, Vec<GrayFrame>)> = settings.into_iter().map(warm).collect();
    let actions = trackers.iter_mut().map(|(tracker, frames)| {
        let mut t = 0;
        let step = move || {
            t += 1;
            black_box(tracker.step(&frames[t % scene::ROUND])).expect("frames of one size");
        };
        Box::new(step) as Action
    });
    clock::medians(ROUNDS, actions.collect())
}

/// Downscaling grows with the pixels, the step does not.
fn frame_sizes() {
    let zooms = [1_usize, 2, 4, 6];
    let (mut downscales, mut steps) = (Vec::new(), Vec::new());
    for zoom in zooms {
        let (width, height) = ((scene::WIDTH * zoom) as u32, (scene::HEIGHT * zoom) as u32);
        let luma = scene::luma(1, zoom);
        let frame = |luma: &[u8]| {
            GrayFrame::from_luma(width, height, luma.to_vec()).expect("a frame of this size")
        };
        let target = scene::target(0).scaled(zoom as f64, zoom as f64);
        let first = frame(&scene::luma(0, zoom));
        let second = frame(&luma);
        let mut tracker =
            Tracker::new(&first, target, Preset::Paper.params()).expect("a box inside the frame");
        for _ in 0..60 {
            tracker.step(&second).expect("frames of one size");
        }
        let times = clock::medians(
            ROUNDS / 4,
            vec![
                Box::new(|| {
                    black_box(frame(&luma));
                }),
                Box::new(|| {
                    black_box(tracker.step(&second)).expect("frames of one size");
                }),
            ],
        );
        downscales.push(times[0]);
        steps.push(times[1]);
    }
    let sizes: Vec<String> = zooms
        .iter()
        .map(|zoom| format!("{} × {}", scene::WIDTH * zoom, scene::HEIGHT * zoom))
        .collect();
    let sizes = sizes.join(" · ");
    println!(
        "| frame: copy and downscale | {sizes} | {} | pixels |",
        micros(&downscales)
    );
    println!("| frame: step | {sizes} | {} | constant |", micros(&steps));
}
