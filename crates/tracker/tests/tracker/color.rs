//! Colour helps where luma does not suffice, and changes nothing in sessions that began in gray.

use bagtrack_tracker::{Frame, Preset, Rect, Tracker};

const WIDTH: usize = 200;
const HEIGHT: usize = 160;
const SIDE: f64 = 32.0;

/// The target's box in frame `t`. It moves right, and passes its twin, which moves left.
fn target(t: usize) -> Rect {
    Rect::new(20.0 + 3.0 * t as f64, 60.0, SIDE, SIDE)
}

fn twin(t: usize) -> Rect {
    Rect::new(140.0 - 3.0 * t as f64, 62.0, SIDE, SIDE)
}

/// Two discs of the same pattern pass each other. The target is red, its twin of the same luma is green.
fn rgb(t: usize) -> Vec<u8> {
    let inside = |area: Rect, x: usize, y: usize| {
        let (cx, cy) = area.center();
        (x as f64 + 0.5 - cx).hypot(y as f64 + 0.5 - cy) < SIDE / 2.0
    };
    let pixel = |i: usize| {
        let (x, y) = (i % WIDTH, i / WIDTH);
        let stripe = |area: Rect| {
            if (x as i64 - area.x as i64) / 5 % 2 == 0 {
                1
            } else {
                2
            }
        };
        // The twin passes in front of the target.
        if inside(twin(t), x, y) {
            return [0, 51 * stripe(twin(t)), 0];
        }
        if inside(target(t), x, y) {
            return [100 * stripe(target(t)), 0, 0];
        }
        [90 + ((x * 7 + y * 13 + x * y) % 40) as u8; 3]
    };
    (0..WIDTH * HEIGHT).flat_map(pixel).collect()
}

fn color(t: usize) -> Frame {
    Frame::from_rgb(WIDTH as u32, HEIGHT as u32, &rgb(t)).expect("a frame of this size")
}

fn gray(t: usize) -> Frame {
    let luma = color(t).pixels().to_vec();
    Frame::from_luma(WIDTH as u32, HEIGHT as u32, luma).expect("a frame of this size")
}

/// The overlap with one seed in the last frame, after the two have passed each other.
fn last_overlap(frame: impl Fn(usize) -> Frame, seed: u64) -> f64 {
    let mut params = Preset::Robust.params();
    params.seed = seed;
    let mut tracker = Tracker::new(&frame(0), target(0), params).expect("a box in the frame");
    let answers = (1..40).map(|t| tracker.step(&frame(t)).expect("frames of one size"));
    let last = answers.last().expect("there are frames");
    last.target.overlap(&target(39))
}

#[test]
fn a_red_target_is_not_taken_for_its_green_twin_that_passes_in_front() {
    for seed in 0..5 {
        let overlap = last_overlap(color, seed);
        assert!(overlap > 0.6, "seed {seed}: {overlap}");
    }
}

/// Without colour only its motion distinguishes the target from its twin.
#[test]
fn the_same_clip_in_gray_is_followed_by_most_seeds() {
    let held = (0..8).filter(|&seed| last_overlap(gray, seed) > 0.6);
    let held: Vec<u64> = held.collect();
    assert!(held.len() >= 6, "{held:?}");
}

/// A red disc on green of the same luma: in gray it is invisible.
#[test]
fn a_target_that_only_color_shows_is_followed() {
    let scene = |t: usize| -> Vec<u8> {
        let (cx, cy) = target(t).center();
        let pixel = |i: usize| {
            let (x, y) = ((i % WIDTH) as f64 + 0.5, (i / WIDTH) as f64 + 0.5);
            let is_inside = (x - cx).hypot(y - cy) < SIDE / 2.0;
            if is_inside { [200, 0, 0] } else { [0, 102, 0] }
        };
        (0..WIDTH * HEIGHT).flat_map(pixel).collect()
    };
    let colored = |t| Frame::from_rgb(WIDTH as u32, HEIGHT as u32, &scene(t)).expect("a frame");
    let flat = |t| {
        let luma = colored(t).pixels().to_vec();
        Frame::from_luma(WIDTH as u32, HEIGHT as u32, luma).expect("a frame")
    };
    let (seen, unseen) = (last_overlap(colored, 0), last_overlap(flat, 0));
    assert!(seen > 0.6 && unseen < 0.2, "{seen} {unseen}");
}

/// A session that began in gray has no colours to compare with, so it uses luma alone.
#[test]
fn a_session_that_began_in_gray_sees_the_luma_of_colored_frames() {
    let begin = || {
        let params = Preset::Robust.params();
        Tracker::new(&gray(0), target(0), params).expect("a box in the frame")
    };
    let (mut of_gray, mut of_color) = (begin(), begin());
    assert!(!of_gray.frame_format().has_color);
    for t in 1..20 {
        let expected = of_gray.step(&gray(t)).expect("frames of one size");
        assert_eq!(of_color.step(&color(t)), Ok(expected), "frame {t}");
    }
}

/// As with a camera that switches to gray at night.
#[test]
fn a_session_in_color_takes_gray_frames_and_holds_the_target() {
    let params = Preset::Robust.params();
    let mut tracker = Tracker::new(&color(0), target(0), params).expect("a box in the frame");
    assert!(tracker.frame_format().has_color);
    for t in 1..12 {
        let frame = if t < 8 { color(t) } else { gray(t) };
        let answer = tracker.step(&frame).expect("frames of one size");
        let overlap = answer.target.overlap(&target(t));
        assert!(overlap > 0.5, "frame {t}: {overlap}");
    }
}

#[test]
fn a_session_in_color_goes_on_from_its_snapshot_bit_for_bit() {
    let params = Preset::Robust.params();
    let mut tracker = Tracker::new(&color(0), target(0), params).expect("a box in the frame");
    for t in 1..15 {
        tracker.step(&color(t)).expect("frames of one size");
    }
    let mut restored = Tracker::restore(&tracker.snapshot()).expect("its own snapshot");
    assert!(tracker.snapshot().len() < 256 * 1024);
    for t in 15..30 {
        assert_eq!(
            tracker.step(&color(t)),
            restored.step(&color(t)),
            "frame {t}"
        );
    }
    assert_eq!(tracker.snapshot(), restored.snapshot());
}

#[test]
fn a_frame_of_bgr_triples_is_that_of_their_rgb_triples() {
    let rgb = rgb(3);
    let swapped: Vec<u8> = rgb
        .as_chunks::<3>()
        .0
        .iter()
        .flat_map(|&[r, g, b]| [b, g, r])
        .collect();
    let size = (WIDTH as u32, HEIGHT as u32);
    assert_eq!(Frame::from_bgr(size.0, size.1, &swapped), Ok(color(3)));
    assert_ne!(Frame::from_bgr(size.0, size.1, &rgb), Ok(color(3)));
    assert!(Frame::from_bgr(size.0, size.1, &swapped[1..]).is_err());
}

/// A frame of 1280 x 960 is tracked at full resolution if its target is 40 pixels wide, and at a lower one if it is 640
/// wide.
#[test]
fn the_resolution_follows_the_target() {
    let luma = (0..1280 * 960)
        .map(|i| ((i % 1280) * 7 % 251) as u8)
        .collect();
    let frame = Frame::from_luma(1280, 960, luma).expect("a frame of this size");
    let size = |target| {
        let tracker = Tracker::new(&frame, target, Preset::Robust.params());
        tracker.expect("a box in the frame").frame_format().size
    };
    assert_eq!(size(Rect::new(600.0, 400.0, 40.0, 40.0)), (1280, 960));
    assert_eq!(size(Rect::new(600.0, 400.0, 128.0, 128.0)), (640, 480));
    assert_eq!(size(Rect::new(300.0, 200.0, 640.0, 480.0)), (320, 240));
}

/// The largest state of a session: full resolution, colour, a full bag.
#[test]
fn a_session_of_full_resolution_keeps_at_most_128_kib() {
    let rgb: Vec<u8> = (0..3 * 1280 * 960)
        .map(|i| ((i % 4999) * (i % 4999) / 97 % 251) as u8)
        .collect();
    let frame = Frame::from_rgb(1280, 960, &rgb).expect("a frame of this size");
    let target = Rect::new(600.0, 400.0, 60.0, 60.0);
    let mut tracker = Tracker::new(&frame, target, Preset::Robust.params()).expect("a box inside");
    for _ in 0..60 {
        tracker.step(&frame).expect("frames of one size");
    }
    assert_eq!(tracker.frame_format().size, (1280, 960));
    let bytes = tracker.snapshot().len();
    assert!(bytes <= 128 * 1024, "{bytes}");
}
