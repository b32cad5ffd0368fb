//! The time of a step against each size that it depends on, with the order that is expected.

use std::hint::black_box;

use bagtrack::ingest::{self, Limits};
use bagtrack::tracker::{GrayFrame, Params, Preset, Tracker};
use jpeg_encoder::{ColorType, Encoder};

use crate::clock::Action;
use crate::fit::{Fit, Order};
use crate::{clock, growth_plot, scene, warm};

/// Both presets have work that comes every fifth or every tenth frame.
const PERIOD: usize = 10;
const ROUNDS: usize = 25;

/// The times of one thing at several sizes.
pub struct Row {
    /// What is timed.
    pub what: &'static str,
    /// What the size is called.
    pub size: &'static str,
    /// The sizes, in ascending order.
    pub sizes: Vec<f64>,
    /// The sizes as text.
    pub labels: Vec<String>,
    /// Seconds at each.
    pub times: Vec<f64>,
    /// What is expected, fitted to the times.
    pub fit: Fit,
}

impl Row {
    fn new(
        (what, size): (&'static str, &'static str),
        sizes: Vec<f64>,
        order: Order,
        times: Vec<f64>,
    ) -> Self {
        Self {
            what,
            size,
            fit: Fit::of(order, &sizes, &times),
            labels: sizes.iter().map(f64::to_string).collect(),
            sizes,
            times,
        }
    }

    fn print(&self) {
        let times: Vec<String> = self
            .times
            .iter()
            .map(|t| format!("{:.0}", t * 1e6))
            .collect();
        println!(
            "| {} | {}: {} | {} | {} | {:.0} % |",
            self.what,
            self.size,
            self.labels.join(" · "),
            times.join(" · "),
            self.fit.text(self.size),
            self.fit.furthest(&self.sizes, &self.times) * 100.0
        );
    }
}

type Change = fn(&mut Params, u32);

/// Prints the table; draws the figure, where a file is named for it.
pub fn print(plot: Option<&str>) {
    println!(
        "µs of a step, of which but one size is the preset's: over {PERIOD} steps in a row, the mean of each one's median \
         of {ROUNDS}; the sizes in turns, processor time of one thread\n"
    );
    println!("| what | size | µs | nearest of the expected order | furthest off |");
    println!("|---|---|---|---|---|");
    let mut rows: Vec<Row> = Vec::new();
    let mut add = |row: Row| {
        row.print();
        rows.push(row);
    };
    use Order::Power;
    let paper: [(&str, &[u32], Order, Change); 4] = [
        ("N", &[50, 100, 200, 400, 800], Power(1), |p, n| {
            p.particles = n;
        }),
        // D = H₁ H₂.
        ("H", &[8, 16, 32, 64], Power(2), |p, side| {
            (p.patch_width, p.patch_height) = (side, side);
        }),
        ("K", &[2, 4, 8, 16, 32], Power(1), |p, k| p.bag_size = k),
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
        ("N", &[50, 100, 200, 400, 800], Power(1), |p, n| {
            p.particles = n;
        }),
        ("K", &[2, 4, 8, 16, 32], Power(1), |p, k| p.bag_size = k),
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
    if let Some(file) = plot {
        let drawn = growth_plot::draw(&rows).and_then(|svg| Ok(std::fs::write(file, svg)?));
        if let Err(error) = drawn {
            eprintln!("tables: {file}: {error}");
            std::process::exit(2);
        }
    }
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
    let mut trackers: Vec<(Tracker, Vec<GrayFrame>)> = values.iter().map(with).collect();
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
    let zooms = [1_usize, 2, 4, 6, 8];
    let mut times = [const { Vec::new() }; 4];
    for zoom in zooms {
        let (width, height) = (scene::WIDTH * zoom, scene::HEIGHT * zoom);
        let luma = scene::luma(1, zoom);
        let frame = |luma: &[u8]| {
            GrayFrame::from_luma(width as u32, height as u32, luma.to_vec())
                .expect("a frame of this size")
        };
        let mut jpeg = Vec::new();
        Encoder::new(&mut jpeg, 85)
            .encode(
                &scene::wall(width, height),
                width as u16,
                height as u16,
                ColorType::Luma,
            )
            .expect("the sides fit a JPEG");
        let limits = Limits::default();
        let target = scene::target(0).scaled(zoom as f64, zoom as f64);
        let (first, second) = (frame(&scene::luma(0, zoom)), frame(&luma));
        let tracker = |preset: Preset| {
            let mut tracker =
                Tracker::new(&first, target, preset.params()).expect("a box inside the frame");
            for _ in 0..60 {
                tracker.step(&second).expect("frames of one size");
            }
            tracker
        };
        let (mut paper, mut robust) = (tracker(Preset::Paper), tracker(Preset::Robust));
        // By themselves: a large frame empties the caches of a step.
        let before = clock::cycles(
            ROUNDS,
            PERIOD,
            vec![
                Box::new(|| {
                    black_box(ingest::decode(&jpeg, &limits)).expect("a whole JPEG");
                }),
                Box::new(|| {
                    black_box(frame(&luma));
                }),
            ],
        );
        let steps = clock::cycles(
            ROUNDS,
            PERIOD,
            vec![
                Box::new(|| {
                    black_box(paper.step(&second)).expect("frames of one size");
                }),
                Box::new(|| {
                    black_box(robust.step(&second)).expect("frames of one size");
                }),
            ],
        );
        for (times, taken) in times.iter_mut().zip(before.into_iter().chain(steps)) {
            times.push(taken);
        }
    }
    let [decode, downscale, paper, robust] = times;
    let row = |what, order, from: usize, times: Vec<f64>| {
        let zooms = &zooms[from..];
        let pixels = |zoom: &usize| (zoom * zoom * scene::WIDTH * scene::HEIGHT) as f64 / 1e6;
        let label = |zoom: &usize| format!("{} × {}", scene::WIDTH * zoom, scene::HEIGHT * zoom);
        let sizes = zooms.iter().map(pixels).collect();
        Row {
            labels: zooms.iter().map(label).collect(),
            ..Row::new(
                (what, "million pixels"),
                sizes,
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
