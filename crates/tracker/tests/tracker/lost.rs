//! While a target is hidden, its box moves with the camera's view of the background.

use bagtrack_testing::scene::robust;
use bagtrack_tracker::{Estimate, Frame, Rect, Status, Tracker};

const WIDTH: usize = 240;
const HEIGHT: usize = 160;
/// The target's width and height.
const SIDES: (usize, usize) = (24, 20);

fn noise(x: usize, y: usize, seed: u32) -> f64 {
    let cell =
        ((x / 3) as u32).wrapping_mul(73_856_093) ^ ((y / 3) as u32).wrapping_mul(19_349_663);
    f64::from((cell ^ seed).wrapping_mul(2_654_435_761) >> 24)
}

/// The background's luma at a place of the world.
fn hills(x: f64, y: f64) -> f64 {
    let waves = (x * 0.13).sin() + (x * 0.041).cos() + (y * 0.11).sin() + (y * 0.053).cos();
    60.0 + 14.0 * waves + noise((x + 90.0) as usize, (y + 90.0) as usize, 9) / 8.0
}

/// The frame of a camera that has moved `camera` pixels to the left, and the target's box in it. The target is drawn
/// only if `is_shown`.
fn scene(at: (usize, usize), camera: usize, is_shown: bool) -> (Frame, Rect) {
    let (left, top) = (at.0 + camera, at.1);
    let luma = (0..WIDTH * HEIGHT).map(|i| {
        let (x, y) = (i % WIDTH, i / WIDTH);
        let inside = (left..left + SIDES.0).contains(&x) && (top..top + SIDES.1).contains(&y);
        match inside {
            true if is_shown => (128.0 + 0.5 * noise(x - left, y - top, 5)) as u8,
            _ => hills(x as f64 - camera as f64, y as f64) as u8,
        }
    });
    let frame = Frame::from_luma(WIDTH as u32, HEIGHT as u32, luma.collect())
        .expect("a frame of this size");
    (
        frame,
        Rect::new(left as f64, top as f64, SIDES.0 as f64, SIDES.1 as f64),
    )
}

/// The tracker after 30 frames in which it has followed a target that moves right.
fn followed(seed: u64) -> Tracker {
    let (first, given) = scene((30, 60), 0, true);
    let mut tracker = Tracker::new(&first, given, robust(seed)).expect("a box inside the frame");
    for t in 1..=30 {
        step(&mut tracker, &scene((30 + t, 60), 0, true).0);
    }
    tracker
}

fn step(tracker: &mut Tracker, frame: &Frame) -> Estimate {
    tracker.step(frame).expect("frames of one size")
}

#[test]
fn the_box_of_a_hidden_target_moves_with_the_camera() {
    let mut lost = 0;
    for seed in 0..3 {
        let mut tracker = followed(seed);
        let mut offset = None;
        for t in 1..=20 {
            // The target's last place, in the picture of a camera that moves by 4 pixels a frame.
            let (frame, place) = scene((60, 60), 4 * t, false);
            let answer = step(&mut tracker, &frame);
            lost += u32::from(answer.status == Status::Lost);
            let now = answer.target.x - place.x;
            let first = *offset.get_or_insert(now);
            assert!(
                (now - first).abs() < 3.0,
                "seed {seed}, frame {t}: {first} and {now}"
            );
        }
    }
    assert!(lost >= 20, "lost in {lost} frames of 60");
}
