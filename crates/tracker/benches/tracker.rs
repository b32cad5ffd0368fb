//! Time of a frame at preset `paper`, on one thread: `cargo bench --bench tracker`.
//!
//! - `step`: the whole of `Tracker::step` on 320 x 240 frames of a textured target that moves over a texture.
//! - `evaluation`: its part from feature vectors to weights, with a full bag and a full history.
//! - `textbook`: the same part as the equations are printed, a decomposition for each candidate.
//! - `product`: one bare double-precision product of N x D by D x 48, which every evaluation needs.
//! - `downscale`: the working image of a 1920 x 1080 upload.
//! - `snapshot`, `restore`, `restore near`: the state of preset `robust` as bytes and back, alone and beside the state
//!   of three frames before.

use std::hint::black_box;

use bagtrack_tracker::{AffineSubspace, Frame, Params, Preset, Rect, Tracker, arg_max, patch};
use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::DMatrix;

use bagtrack_testing::bench_scene::{frame, target};

fn step(criterion: &mut Criterion) {
    let frames: Vec<Frame> = (0..64).map(frame).collect();
    let params = Preset::Paper.params();
    let mut tracker = Tracker::new(&frames[0], target(0), params).expect("a box inside the frame");
    let mut t = 0;
    let mut next = || {
        t = (t + 1) % frames.len();
        tracker.step(&frames[t]).expect("frames of one size")
    };
    for _ in 0..64 {
        next();
    }
    criterion.bench_function("step", |bencher| bencher.iter(|| black_box(next())));
}

fn evaluation(criterion: &mut Criterion) {
    let params: Params = Preset::Paper.params();
    let look = |t: usize, shift: f64| {
        let area = target(t);
        let moved = Rect::new(
            area.x + shift,
            area.y - shift / 2.0,
            area.width,
            area.height,
        );
        patch(&frame(t), &moved, &params)
    };
    let looks: Vec<Vec<f32>> = (0..60).map(|t| look(t, (t % 7) as f64 * 0.3)).collect();
    let candidates: Vec<Vec<f32>> = (0..params.particles)
        .map(|i| look(61, f64::from(i) / 5.0 - 10.0))
        .collect();
    let slices: Vec<&[f32]> = looks.iter().map(Vec::as_slice).collect();
    let bag: Vec<AffineSubspace> = slices[..50]
        .chunks(5)
        .map(|looks| AffineSubspace::of(looks, 3))
        .collect();
    let history = &slices[50..55];

    let vectors = candidates.concat();
    let mut shipped = bagtrack_testing::textbook::shipped(&candidates, history, &bag, &params);
    criterion.bench_function("evaluation", |bencher| {
        bencher.iter(|| {
            shipped.compute(&vectors, black_box(history));
            arg_max(&shipped.weights)
        })
    });
    criterion.bench_function("textbook", |bencher| {
        bencher.iter(|| {
            bagtrack_testing::textbook::evaluate(&candidates, black_box(history), &bag, &params)
        })
    });
}

fn product(criterion: &mut Criterion) {
    let d = 1024;
    let a = DMatrix::from_fn(48, d, |i, j| (i * 31 + j * 7) as f64 % 13.0);
    let b = DMatrix::from_fn(d, 106, |i, j| (i * 17 + j * 5) as f64 % 11.0);
    let mut c = DMatrix::zeros(48, 106);
    criterion.bench_function("product", |bencher| {
        bencher.iter(|| c.gemm(1.0, black_box(&a), black_box(&b), 0.0))
    });
}

fn downscale(criterion: &mut Criterion) {
    let luma: Vec<u8> = (0..1920 * 1080).map(|i| (i * 7 % 251) as u8).collect();
    criterion.bench_function("downscale", |bencher| {
        bencher.iter_batched(
            || luma.clone(),
            |luma| Frame::from_luma(1920, 1080, luma),
            criterion::BatchSize::LargeInput,
        )
    });
}

fn snapshot(criterion: &mut Criterion) {
    let params = Preset::Robust.params();
    let mut tracker = Tracker::new(&frame(0), target(0), params).expect("a box inside the frame");
    let mut behind = tracker.clone();
    for t in 1..64 {
        tracker.step(&frame(t)).expect("frames of one size");
        if t == 60 {
            behind = tracker.clone();
        }
    }
    let bytes = tracker.snapshot();
    criterion.bench_function("snapshot", |bencher| bencher.iter(|| tracker.snapshot()));
    criterion.bench_function("restore", |bencher| {
        bencher.iter(|| Tracker::restore(black_box(&bytes)).expect("its own snapshot"))
    });
    criterion.bench_function("restore near", |bencher| {
        bencher.iter(|| {
            behind
                .restore_near(black_box(&bytes), None)
                .expect("its own snapshot")
        })
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(30).measurement_time(std::time::Duration::from_secs(3));
    targets = step, evaluation, product, downscale, snapshot
}
criterion_main!(benches);
