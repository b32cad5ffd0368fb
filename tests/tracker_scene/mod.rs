//! Frames for the tracker's tests, drawn by a formula: a textured square that moves over a texture.

#![allow(dead_code)] // Each test binary uses its part.

use bagtrack::tracker::{GrayFrame, Params, Preset, Rect};

fn texture(x: usize, y: usize, seed: u32) -> u8 {
    let cell =
        ((x / 3) as u32).wrapping_mul(73_856_093) ^ ((y / 3) as u32).wrapping_mul(19_349_663);
    ((cell ^ seed).wrapping_mul(2_654_435_761) >> 24) as u8
}

/// Up and down between 0 and `top`, a step a frame.
fn bounce(t: usize, top: usize) -> f64 {
    let phase = t % (2 * top);
    phase.min(2 * top - phase) as f64
}

/// The target's box in frame `t`: a pixel a frame along both axes.
pub fn target(t: usize) -> Rect {
    Rect::new(20.0 + bounce(t, 60), 18.0 + bounce(t, 40), 24.0, 20.0)
}

/// Frame `t`, 120 x 90 pixels: the target is bright texture on dark.
pub fn frame(t: usize) -> GrayFrame {
    let (width, height) = (120, 90);
    let area = target(t);
    let (left, top) = (area.x as usize, area.y as usize);
    let luma = (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let inside = (left..left + 24).contains(&x) && (top..top + 20).contains(&y);
            if inside {
                128 + texture(x - left, y - top, 5) / 2
            } else {
                texture(x, y, 9) / 4
            }
        })
        .collect();
    GrayFrame::from_luma(width as u32, height as u32, luma).expect("a frame of this size")
}

/// A frame of one gray value.
pub fn flat(width: u32, height: u32, value: u8) -> GrayFrame {
    let pixels = vec![value; width as usize * height as usize];
    GrayFrame::from_luma(width, height, pixels).expect("a frame of this size")
}

/// The paper's parameters with another seed.
pub fn params(seed: u64) -> Params {
    Params {
        seed,
        ..Preset::Paper.params()
    }
}
