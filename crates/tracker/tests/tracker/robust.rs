//! The default parameters hold the target, also when the camera swings, and after a correction.

use bagtrack_testing::scene::{frame, leaping, near, panned, receding, robust, target, tilting};
use bagtrack_tracker::{Frame, Params, Preset, Rect, Tracker};

/// The mean overlap with the exact boxes of `scene` in its frames from 1 to `last`.
fn mean_overlap(scene: impl Fn(usize) -> (Frame, Rect), last: usize, params: Params) -> f64 {
    let (first, given) = scene(0);
    let mut tracker = Tracker::new(&first, given, params).expect("a box inside the frame");
    let overlaps = (1..=last).map(|t| {
        let (frame, truth) = scene(t);
        let answer = tracker.step(&frame).expect("frames of one size");
        answer.target.overlap(&truth)
    });
    overlaps.sum::<f64>() / last as f64
}

#[test]
fn the_default_is_robust() {
    assert_eq!(Preset::default(), Preset::Robust);
    assert_eq!(Params::default(), robust(0));
}

#[test]
fn a_moving_target_is_held() {
    for seed in 0..3 {
        let overlap = mean_overlap(|t| (frame(t), target(t)), 79, robust(seed));
        println!("seed {seed}: overlap {overlap:.3}");
        assert!(overlap >= 0.7, "seed {seed}: {overlap}");
    }
}

#[test]
fn a_target_that_shrinks_while_its_background_grows_keeps_its_box() {
    for seed in 0..3 {
        let (first, given) = receding(0);
        let mut tracker = Tracker::new(&first, given, robust(seed)).expect("a box inside");
        for t in 1..=70 {
            let (frame, truth) = receding(t);
            let answer = tracker.step(&frame).expect("frames of one size").target;
            let ratio = (answer.width / truth.width).ln();
            assert!(ratio.abs() < 0.12, "seed {seed}, frame {t}: {ratio:+.3}");
            let overlap = answer.overlap(&truth);
            assert!(overlap > 0.75, "seed {seed}, frame {t}: {overlap:.3}");
        }
    }
}

/// The three targets are tracked in working pixels of 1 x 1, 2 x 2 and 4 x 4 pixels of the frame.
#[test]
fn a_target_is_held_as_well_when_it_is_large() {
    for (width, height) in [(60, 50), (110, 96), (200, 170)] {
        for seed in 0..3 {
            let overlap = mean_overlap(|t| near(t, (width, height)), 50, robust(seed));
            println!("{width} x {height}, seed {seed}: overlap {overlap:.3}");
            assert!(overlap >= 0.9, "{width} x {height}, seed {seed}: {overlap}");
        }
    }
}

#[test]
fn a_target_that_leaps_by_its_own_length_is_held() {
    for seed in 0..3 {
        let overlap = mean_overlap(leaping, 60, robust(seed));
        println!("seed {seed}: overlap {overlap:.3}");
        assert!(overlap >= 0.7, "seed {seed}: {overlap}");
    }
}

#[test]
fn without_a_look_at_every_place_the_leaps_lose_the_target() {
    // Shows that the test above depends on the search at every place.
    let params = Params {
        dense_maxima: 0,
        ..robust(0)
    };
    let (first, given) = leaping(0);
    let mut tracker = Tracker::new(&first, given, params).expect("a box inside the frame");
    let held = (1..=60).filter(|&t| {
        let (frame, truth) = leaping(t);
        let answer = tracker.step(&frame).expect("frames of one size");
        answer.target.overlap(&truth) > 0.5
    });
    let held = held.count();
    assert!(held < 45, "{held}");
}

/// The mean distance of the answers from the target's centre in the last frames of `tilting`, in units of `zoom`
/// pixels.
fn off_when_tilted(params: Params, zoom: usize) -> f64 {
    let (first, given) = tilting(0, zoom);
    let mut tracker = Tracker::new(&first, given, params).expect("a box inside the frame");
    let off = (1..90).map(|t| {
        let (frame, truth) = tilting(t, zoom);
        let answer = tracker.step(&frame).expect("frames of one size").target;
        answer.center_distance(&truth)
    });
    off.skip(40).sum::<f64>() / 49.0 / zoom as f64
}

#[test]
fn a_head_that_tilts_stays_in_the_middle_of_its_box() {
    for (seed, zoom) in [(0, 1), (1, 1), (2, 1), (0, 3), (1, 3), (2, 3)] {
        let off = off_when_tilted(robust(seed), zoom);
        println!("seed {seed}, {zoom} times: {off:.2} px");
        assert!(off < 0.8, "seed {seed}, {zoom}: {off}");
    }
}

/// The mean overlap while the camera swings back and forth; each swing takes a single frame, along x and y at once.
fn overlap_through_swings(params: Params) -> f64 {
    let camera = |t: usize| {
        if (t / 12).is_multiple_of(2) {
            (0, 0)
        } else {
            (44, 44)
        }
    };
    mean_overlap(|t| panned(t, camera(t)), 72, params)
}

#[test]
fn a_target_is_held_through_swings_of_the_camera_by_its_global_motion() {
    for seed in 0..3 {
        let with = overlap_through_swings(robust(seed));
        let without = overlap_through_swings(Params {
            global_motion: false,
            ..robust(seed)
        });
        println!("seed {seed}: overlap {with:.3}, without global motion {without:.3}");
        assert!(with >= 0.9, "seed {seed}: {with}");
        assert!(without < 0.8, "seed {seed}: {without}");
    }
}

#[test]
fn a_replay_gives_the_same_bits_on_any_thread() {
    let run = |seed| {
        let mut tracker =
            Tracker::new(&frame(0), target(0), robust(seed)).expect("a box inside the frame");
        let answers: Vec<_> = (1..65)
            .map(|t| match t {
                33 => tracker.retarget(&frame(t), target(t)),
                _ => tracker.step(&frame(t)),
            })
            .map(|answer| answer.expect("frames of one size"))
            .collect();
        (answers, tracker.snapshot())
    };
    let here = run(7);
    let there = std::thread::spawn(move || run(7)).join();
    assert_eq!(here, there.expect("no panic"));
    assert_ne!(here.1, run(8).1);
}

#[test]
fn the_same_target_is_followed_after_a_correction() {
    for seed in 0..3 {
        let start = Tracker::new(&frame(0), target(0), robust(seed));
        let mut tracker = start.expect("a box inside the frame");
        for t in 1..30 {
            tracker.step(&frame(t)).expect("frames of one size");
        }
        // After a cut the target is elsewhere, so the box is corrected.
        let corrected = tracker.retarget(&frame(110), target(110));
        let corrected = corrected.expect("a box inside the frame");
        assert_eq!((corrected.frame, corrected.target), (30, target(110)));
        let overlaps = (111..151).map(|t| {
            let answer = tracker.step(&frame(t)).expect("frames of one size");
            answer.target.overlap(&target(t))
        });
        let overlap = overlaps.sum::<f64>() / 40.0;
        println!("seed {seed}: overlap {overlap:.3}");
        assert!(overlap >= 0.7, "seed {seed}: {overlap}");
    }
}

#[test]
fn another_target_is_followed_after_a_correction_though_the_first_stays_in_sight() {
    for seed in 0..3 {
        let scene = bagtrack_testing::scene::pair;
        let (first, given, _) = scene(0);
        let mut tracker = Tracker::new(&first, given, robust(seed)).expect("a box in the frame");
        for t in 1..30 {
            tracker.step(&scene(t).0).expect("frames of one size");
        }
        let (frame, _, other) = scene(30);
        tracker.retarget(&frame, other).expect("a box in the frame");
        let overlaps = (31..91).map(|t| {
            let (frame, _, truth) = scene(t);
            let answer = tracker.step(&frame).expect("frames of one size");
            answer.target.overlap(&truth)
        });
        let overlap = overlaps.sum::<f64>() / 60.0;
        println!("seed {seed}: overlap {overlap:.3}");
        assert!(overlap >= 0.7, "seed {seed}: {overlap}");
    }
}
