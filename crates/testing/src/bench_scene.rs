//! The scene of the benchmarks: a textured target that moves on a circle over a texture.

use bagtrack_tracker::{Frame, Params, Rect, Tracker};

pub const WIDTH: usize = 320;
pub const HEIGHT: usize = 240;
/// Frames until the target is at its first place again.
pub const ROUND: usize = 64;

fn texture(x: usize, y: usize, seed: u32) -> u8 {
    // Blocks of 4 x 4 pixels with hashed gray values, softened by a gradient.
    let (column, row) = ((x / 4) as u32, (y / 4) as u32);
    let cell = column.wrapping_mul(73_856_093) ^ row.wrapping_mul(19_349_663) ^ seed;
    let hash = cell.wrapping_mul(2_654_435_761) >> 24;
    (hash / 2 + (x * 3 + y * 2) as u32 % 120) as u8
}

/// The upper left corner of the target, which has 60 x 48 pixels, in frame `t`.
fn place(t: usize) -> (usize, usize) {
    let angle = t as f64 / ROUND as f64 * std::f64::consts::TAU;
    let (sine, cosine) = angle.sin_cos();
    (
        (130.0 + 60.0 * cosine) as usize,
        (96.0 + 50.0 * sine) as usize,
    )
}

/// The gray values of frame `t`, row by row, with each pixel `zoom` x `zoom` times.
pub fn luma(t: usize, zoom: usize) -> Vec<u8> {
    let (left, top) = place(t);
    let pixel = |x: usize, y: usize| {
        if (left..left + 60).contains(&x) && (top..top + 48).contains(&y) {
            texture(x - left, y - top, 2)
        } else {
            texture(x, y, 1)
        }
    };
    let (width, height) = (WIDTH * zoom, HEIGHT * zoom);
    (0..width * height)
        .map(|i| pixel(i % width / zoom, i / width / zoom))
        .collect()
}

/// Gray values of a picture of any size without the target, with the same detail per pixel at every
/// size.
pub fn wall(width: usize, height: usize) -> Vec<u8> {
    (0..width * height)
        .map(|i| texture(i % width, i / width, 1))
        .collect()
}

pub fn frame(t: usize) -> Frame {
    Frame::from_luma(WIDTH as u32, HEIGHT as u32, luma(t, 1)).expect("a frame of this size")
}

pub fn frames() -> Vec<Frame> {
    (0..ROUND).map(frame).collect()
}

/// A tracker of the target that has seen whole rounds of these frames, until its history and its bag are full.
pub fn warm(frames: &[Frame], params: Params) -> Tracker {
    let until = (params.bag_size * params.update_every) as usize + 1;
    let mut tracker = Tracker::new(&frames[0], target(0), params).expect("a box inside the frame");
    for t in 1..=until.next_multiple_of(ROUND) {
        tracker
            .step(&frames[t % ROUND])
            .expect("frames of one size");
    }
    tracker
}

/// The box of the target in frame `t`.
pub fn target(t: usize) -> Rect {
    let (left, top) = place(t);
    Rect::new(left as f64, top as f64, 60.0, 48.0)
}
