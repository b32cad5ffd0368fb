//! The time of a step by each size that it depends on, and of the preparation of the frame by the frame's size.

use std::hint::black_box;

use bagtrack_ingest::Limits;
use bagtrack_tracker::{Frame, Params, Preset, Tracker};
use jpeg_encoder::{ColorType, Encoder};

use crate::clock::Action;
use crate::{clock, scene, warm};

/// Calls in a period: both presets have work that is done every fifth or every tenth frame.
const PERIOD: usize = 10;
const ROUNDS: usize = 25;

/// A parameter: its name, its values, and how it is set.
type Size = (&'static str, &'static [u32], fn(&mut Params, u32));

pub fn print() {
    println!(
        "µs of a step, of which but one size is the preset's: over {PERIOD} steps in a row, the mean of each one's median \
         of {ROUNDS}; the sizes in turns, processor time of one thread\n"
    );
    println!("| what | size | µs |");
    println!("|---|---|---|");
    let particles: Size = ("N", &[50, 100, 200, 400, 800], |p, n| p.particles = n);
    // D = H₁ H₂.
    let side: Size = ("H", &[8, 16, 32, 64], |p, side| {
        (p.patch_width, p.patch_height) = (side, side);
    });
    let entries: Size = ("K", &[2, 4, 8, 16, 32], |p, k| p.bag_size = k);
    let history: Size = ("P", &[1, 2, 5, 10], |p, history| p.history = history);
    let samples: Size = ("background samples", &[16, 32, 64, 128], |p, samples| {
        p.background_samples = samples;
    });
    for size in [particles, side, entries, history] {
        print_steps(Preset::Paper, "`paper`", size);
    }
    for size in [particles, entries, samples] {
        print_steps(Preset::Robust, "`robust`", size);
    }
    print_frame_sizes();
}

fn print_row(what: &str, size: &str, values: Vec<String>, times: &[f64]) {
    let values = values.join(" · ");
    let times: Vec<String> = times.iter().map(|t| format!("{:.0}", t * 1e6)).collect();
    println!("| {what} | {size}: {values} | {} |", times.join(" · "));
}

/// Times steps of a preset with one parameter at each of these values.
fn print_steps(preset: Preset, what: &str, (size, values, change): Size) {
    let with = |&value: &u32| {
        let mut params = preset.params();
        change(&mut params, value);
        warm(params)
    };
    let mut trackers: Vec<(Tracker, Vec<Frame>)> = values.iter().map(with).collect();
    let actions = trackers.iter_mut().map(|(tracker, frames)| {
        let mut t = 0;
        let step = move || {
            t += 1;
            black_box(tracker.step(&frames[t % scene::ROUND])).expect("frames of one size");
        };
        Box::new(step) as Action
    });
    let times = clock::cycles(ROUNDS, PERIOD, actions.collect());
    let values = values.iter().map(u32::to_string).collect();
    print_row(what, size, values, &times);
}

/// The preparation of the frame takes time in proportion to its pixels, the step does not.
fn print_frame_sizes() {
    let mut sizes = [1, 2, 4, 6, 8].map(FrameSize::new);
    let limits = Limits::default();
    print_timed(
        "decoding a gray JPEG and downscaling it",
        &mut sizes,
        |size| {
            black_box(bagtrack_ingest::decode(&size.jpeg, &limits)).expect("a whole JPEG");
        },
    );
    // The smallest frame has the working size already, and is only copied.
    print_timed("copying and downscaling luma", &mut sizes[1..], |size| {
        black_box(frame(size.zoom, &size.luma));
    });
    for (preset, what) in ["step, `paper`", "step, `robust`"].into_iter().enumerate() {
        print_timed(what, &mut sizes, |size| {
            black_box(size.trackers[preset].step(&size.seen)).expect("frames of one size");
        });
    }
}

/// The data to time frames of one size with.
struct FrameSize {
    zoom: usize,
    jpeg: Vec<u8>,
    luma: Vec<u8>,
    seen: Frame,
    /// The trackers of both presets.
    trackers: [Tracker; 2],
}

fn frame(zoom: usize, luma: &[u8]) -> Frame {
    let (width, height) = (scene::WIDTH * zoom, scene::HEIGHT * zoom);
    Frame::from_luma(width as u32, height as u32, luma.to_vec()).expect("a frame of this size")
}

impl FrameSize {
    fn new(zoom: usize) -> Self {
        let (width, height) = (scene::WIDTH * zoom, scene::HEIGHT * zoom);
        let mut jpeg = Vec::new();
        Encoder::new(&mut jpeg, 85)
            .encode(
                &scene::wall(width, height),
                width as u16,
                height as u16,
                ColorType::Luma,
            )
            .expect("the sides fit a JPEG");
        let luma = scene::luma(1, zoom);
        let (first, seen) = (frame(zoom, &scene::luma(0, zoom)), frame(zoom, &luma));
        let target = scene::target(0).scaled(zoom as f64, zoom as f64);
        let trackers = [Preset::Paper, Preset::Robust].map(|preset| {
            let mut tracker =
                Tracker::new(&first, target, preset.params()).expect("a box inside the frame");
            for _ in 0..60 {
                tracker.step(&seen).expect("frames of one size");
            }
            tracker
        });
        Self {
            zoom,
            jpeg,
            luma,
            seen,
            trackers,
        }
    }

    fn width(&self) -> usize {
        scene::WIDTH * self.zoom
    }

    fn height(&self) -> usize {
        scene::HEIGHT * self.zoom
    }
}

/// Times `work` at each of `sizes`, in turns.
fn print_timed(what: &str, sizes: &mut [FrameSize], work: impl Fn(&mut FrameSize)) {
    let labels = sizes
        .iter()
        .map(|size| format!("{} × {}", size.width(), size.height()))
        .collect();
    let work = &work;
    let actions = sizes
        .iter_mut()
        .map(|size| Box::new(move || work(size)) as Action);
    let times = clock::cycles(ROUNDS, PERIOD, actions.collect());
    print_row(what, "frame", labels, &times);
}
