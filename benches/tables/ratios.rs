//! The time of a step compared with the textbook version and with one bare matrix product.

use std::hint::black_box;

use bagtrack_sample::{Clip, Scene, Settings};
use bagtrack_tracker::{AffineSubspace, Frame, Params, Preset, Rect, Status, Tracker, patch};
use nalgebra::DMatrix;

use crate::{clock, scene, textbook, warm};

const ROUNDS: usize = 300;

/// Median seconds of each action, measured in turns.
struct Times {
    step: f64,
    robust_step: f64,
    /// Seconds of the arithmetic of `paper`.
    evaluation: f64,
    /// Seconds of the same arithmetic in the textbook version.
    textbook: f64,
    /// Seconds of one matrix product of the sizes in `shape`.
    product: f64,
    /// The columns of the product, the length of a vector, and the rows.
    shape: [usize; 3],
}

pub fn print() {
    let Times {
        step,
        robust_step,
        evaluation,
        textbook,
        product,
        shape: [columns, len, rows],
    } = measure();
    println!("median of {ROUNDS} rounds, in turns, processor time of one thread\n");
    println!("| what | µs | |");
    println!("|---|---|---|");
    let line = |what: &str, seconds: f64, note: String| {
        println!("| {what} | {:.0} | {note} |", seconds * 1e6);
    };
    line("`Tracker::step`, `paper`", step, String::new());
    line("`Tracker::step`, `robust`", robust_step, String::new());
    let (lost, note) = out_of_sight(robust_step);
    line(
        "the same while the target is out of sight, in a clip of `sample`",
        lost,
        note,
    );
    let note = format!("{:.1} × the product", evaluation / product);
    line(
        "the arithmetic of `paper`: feature vectors to weights",
        evaluation,
        note,
    );
    let what = format!(
        "one bare product by nalgebra, {columns} × {len} by {len} × {rows}, f64 as in the step"
    );
    line(&what, product, String::new());
    let note = format!(
        "{:.0} × the arithmetic, {:.0} × the whole step",
        textbook / evaluation,
        textbook / step
    );
    line("the textbook version of the same", textbook, note);
}

fn measure() -> Times {
    let params = Preset::Paper.params();
    let looks: Vec<Vec<f32>> = (0..55)
        .map(|t| look(t, (t % 7) as f64 * 0.3, &params))
        .collect();
    let looks: Vec<&[f32]> = looks.iter().map(Vec::as_slice).collect();
    let candidates: Vec<Vec<f32>> = (0..params.particles)
        .map(|i| look(61, f64::from(i) / 5.0 - 10.0, &params))
        .collect();
    let bag: Vec<AffineSubspace> = looks[..50]
        .chunks(5)
        .map(|looks| AffineSubspace::of(looks, params.basis_dim as usize))
        .collect();
    let history = &looks[50..];

    let vectors = candidates.concat();
    let mut evaluation = textbook::shipped(&candidates, history, &bag, &params);
    let (mut paper, frames) = warm(params.clone());
    let (mut robust, _) = warm(Preset::Robust.params());
    // The sizes and the precision of the product that the evaluation contains.
    let rows = (params.particles + params.history + 1) as usize;
    let columns = (params.history + 1 + params.bag_size * (params.basis_dim + 1)) as usize;
    let len = params.feature_len();
    let left = DMatrix::from_fn(columns, len, |i, j| (i * 31 + j * 7) as f64 % 13.0);
    let right = DMatrix::from_fn(len, rows, |i, j| (i * 17 + j * 5) as f64 % 11.0);
    let mut product = DMatrix::zeros(columns, rows);

    let (mut t, mut u) = (0, 0);
    let times = clock::medians(
        ROUNDS,
        vec![
            Box::new(|| {
                t += 1;
                black_box(paper.step(&frames[t % scene::ROUND])).expect("frames of one size");
            }),
            Box::new(|| {
                u += 1;
                black_box(robust.step(&frames[u % scene::ROUND])).expect("frames of one size");
            }),
            Box::new(|| evaluation.compute(&vectors, black_box(history))),
            Box::new(|| product.gemm(1.0, black_box(&left), black_box(&right), 0.0)),
        ],
    );
    let [step, robust_step, evaluation, product] = times[..] else {
        unreachable!("one time for each action")
    };
    // Timed alone: in turns it would evict the others' data from the caches.
    let textbook = clock::medians(
        ROUNDS / 4,
        vec![Box::new(|| {
            black_box(textbook::evaluate(&candidates, history, &bag, &params));
        })],
    )[0];
    Times {
        step,
        robust_step,
        evaluation,
        textbook,
        product,
        shape: [columns, len, rows],
    }
}

/// The feature vector of the target's box in frame `t`, moved by `shift` pixels to the right and half of that up.
fn look(t: usize, shift: f64, params: &Params) -> Vec<f32> {
    let area = scene::target(t);
    let (x, y) = (area.x + shift, area.y - shift / 2.0);
    let moved = Rect::new(x, y, area.width, area.height);
    patch(&scene::frame(t), &moved, params)
}

/// Seconds of a step of `robust` while the target is out of sight, in a drawn clip; and the ratio. Timed
/// alone, because so many particles would evict the others' data from the caches.
fn out_of_sight(held: f64) -> (f64, String) {
    let settings = Settings {
        scene: Scene::Leaves,
        ..Settings::default()
    };
    let clip = Clip::new(settings).expect("the settings are in order");
    let frame = |index: u32| {
        let luma = image::DynamicImage::from(clip.draw(index)).into_luma8();
        Frame::from_luma(luma.width(), luma.height(), luma.into_raw()).expect("a whole picture")
    };
    let mut tracker = Tracker::new(&frame(0), clip.target(0), Preset::Robust.params())
        .expect("a box inside the frame");
    let mut index = 1;
    while clip.visible(index) > 0.0 {
        tracker.step(&frame(index)).expect("frames of one size");
        index += 1;
    }
    let hidden = (index..clip.frames()).take_while(|&index| clip.visible(index) == 0.0);
    let hidden: Vec<Frame> = hidden.map(frame).collect();
    // Twice through the hidden frames, so that the search reaches its full width.
    for frame in hidden.iter().chain(&hidden) {
        tracker.step(frame).expect("frames of one size");
    }
    let (mut t, mut found) = (0, 0);
    let times = clock::medians(
        ROUNDS,
        vec![Box::new(|| {
            t += 1;
            let estimate = black_box(tracker.step(&hidden[t % hidden.len()]));
            let status = estimate.expect("frames of one size").status;
            found += usize::from(status != Status::Lost);
        })],
    );
    let ratio = times[0] / held;
    let note = match found {
        0 => format!("{ratio:.1} × a step that has it"),
        found => {
            format!("{ratio:.1} × a step that has it, but {found} of {ROUNDS} were not `lost`")
        }
    };
    (times[0], note)
}
