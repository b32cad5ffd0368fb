//! The time of a step against each size that it depends on, with the order that is expected.

use std::hint::black_box;

use bagtrack_ingest::Limits;
use bagtrack_tracker::{Frame, Params, Preset, Tracker};
use jpeg_encoder::{ColorType, Encoder};

use crate::clock::Action;
use crate::fit::Order;
use crate::growth_row::Row;
use crate::{clock, scene, warm};

/// Both presets have work that comes every fifth or every tenth frame.
const PERIOD: usize = 10;
const ROUNDS: usize = 25;

type Change = fn(&mut Params, u32);

/// Prints the table.
pub fn print() {
    println!(
        "µs of a step, of which but one size is the preset's: over {PERIOD} steps in a row, the mean of each one's median \
         of {ROUNDS}; the sizes in turns, processor time of one thread\n"
    );
    println!("| what | size | µs | nearest of the expected order | furthest off |");
    println!("|---|---|---|---|---|");
    let add = |row: Row| row.print();
    use Order::Power;
    let particles: (&str, &[u32], Order, Change) =
        ("N", &[50, 100, 200, 400, 800], Power(1), |p, n| {
            p.particles = n;
        });
    let entries: (&str, &[u32], Order, Change) =
        ("K", &[2, 4, 8, 16, 32], Power(1), |p, k| p.bag_size = k);
    let paper: [(&str, &[u32], Order, Change); 4] = [
        particles,
        // D = H₁ H₂.
        ("H", &[8, 16, 32, 64], Power(2), |p, side| {
            (p.patch_width, p.patch_height) = (side, side);
        }),
        entries,
        ("P", &[1, 2, 5, 10], Power(3), |p, history| {
            p.history = history;
        }),
    ];
    for (size, values, order, change) in paper {
        add(steps(
            (Preset::Paper, "`paper`", size),
            values,
            order,
            change,
        ));
    }
    let robust: [(&str, &[u32], Order, Change); 3] = [
        particles,
        entries,
        (
            "background samples",
            &[16, 32, 64, 128],
            Power(1),
            |p, samples| {
                p.background_samples = samples;
            },
        ),
    ];
    for (size, values, order, change) in robust {
        add(steps(
            (Preset::Robust, "`robust`", size),
            values,
            order,
            change,
        ));
    }
    frame_sizes().into_iter().for_each(add);
}

/// Steps of a preset with one parameter at each of these values.
fn steps(
    (preset, what, size): (Preset, &'static str, &'static str),
    values: &[u32],
    order: Order,
    change: Change,
) -> Row {
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
    let sizes = values.iter().map(|&value| f64::from(value)).collect();
    Row::new((what, size), sizes, order, times)
}

/// What comes before a step grows with the pixels of the frame, the step does not.
fn frame_sizes() -> [Row; 4] {
    let mut sizes = [1, 2, 4, 6, 8].map(FrameSize::new);
    let limits = Limits::default();
    let decode = timed(&mut sizes, |size| {
        black_box(bagtrack_ingest::decode(&size.jpeg, &limits)).expect("a whole JPEG");
    });
    let downscale = timed(&mut sizes, |size| {
        black_box(frame(size.zoom, &size.luma));
    });
    let [paper, robust] = [0, 1].map(|preset| {
        timed(&mut sizes, |size| {
            black_box(size.trackers[preset].step(&size.seen)).expect("frames of one size");
        })
    });
    let row = |what, order, from: usize, times: Vec<f64>| {
        let sizes = &sizes[from..];
        let pixels = |size: &FrameSize| (size.width() * size.height()) as f64 / 1e6;
        let label = |size: &FrameSize| format!("{} × {}", size.width(), size.height());
        Row {
            labels: sizes.iter().map(label).collect(),
            ..Row::new(
                (what, "million pixels"),
                sizes.iter().map(pixels).collect(),
                order,
                times[from..].to_vec(),
            )
        }
    };
    let (pixels, constant) = (Order::Power(1), Order::Constant);
    [
        row("decoding a gray JPEG and downscaling it", pixels, 0, decode),
        // The smallest is the working image already: it is only copied.
        row("copying and downscaling luma", pixels, 1, downscale),
        row("step, `paper`", constant, 0, paper),
        row("step, `robust`", constant, 0, robust),
    ]
}

/// What frames of one size are timed with.
struct FrameSize {
    zoom: usize,
    jpeg: Vec<u8>,
    luma: Vec<u8>,
    seen: Frame,
    /// Of both presets.
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

/// Seconds that `work` takes at each of `sizes`, which take turns.
fn timed(sizes: &mut [FrameSize], work: impl Fn(&mut FrameSize)) -> Vec<f64> {
    let work = &work;
    let actions = sizes
        .iter_mut()
        .map(|size| Box::new(move || work(size)) as Action);
    clock::cycles(ROUNDS, PERIOD, actions.collect())
}
