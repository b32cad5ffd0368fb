//! Extreme input gets a finite box or a typed error, never NaN, never a panic.

use bagtrack_testing::scene::{flat, frame, params, robust, variants};
use bagtrack_tracker::{Estimate, Frame, MIN_BOX_SIDE, Params, Rect, Tracker, TrackerError};
use proptest::prelude::*;

fn assert_sound(answer: &Estimate) {
    assert!(answer.target.is_valid(), "{answer:?}");
    assert!((0.0..=1.0).contains(&answer.score), "{answer:?}");
}

/// Starts on the first frame, steps through the rest, and takes and restores a snapshot after every step.
fn run(frames: &[Frame], target: Rect, params: Params) -> Vec<Estimate> {
    let mut tracker = Tracker::new(&frames[0], target, params).expect("an acceptable box");
    frames[1..]
        .iter()
        .map(|frame| {
            let answer = tracker.step(frame).expect("frames of one size");
            assert_sound(&answer);
            tracker = Tracker::restore(&tracker.snapshot()).expect("an own snapshot");
            answer
        })
        .collect()
}

/// As [`run`], with both presets, and with each extension switched off.
fn run_variants(frames: &[Frame], target: Rect, seed: u64) {
    for (name, params) in variants(seed) {
        println!("{name}");
        run(frames, target, params);
    }
}

#[test]
fn flat_frames_of_every_brightness_have_answers() {
    for value in [0, 1, 128, 255] {
        let frames = vec![flat(64, 48, value); 14];
        run_variants(&frames, Rect::new(10.0, 10.0, 16.0, 16.0), 1);
    }
}

#[test]
fn a_target_that_goes_black_and_comes_back_has_answers() {
    let mut frames: Vec<Frame> = (0..8).map(frame).collect();
    frames.extend(vec![flat(120, 90, 0); 12]);
    frames.extend((8..20).map(frame));
    run_variants(&frames, bagtrack_testing::scene::target(0), 2);
}

#[test]
fn a_black_start_has_answers_when_the_light_comes_on() {
    let mut frames = vec![flat(120, 90, 0); 2];
    frames.extend((0..12).map(frame));
    run_variants(&frames, bagtrack_testing::scene::target(0), 3);
}

/// Every patch of a flat frame is the same, so all candidates are at the same distance.
#[test]
fn equal_distances_give_the_first_particle() {
    let target = Rect::new(140.0, 100.0, 40.0, 40.0);
    let frames = [flat(320, 240, 90), flat(320, 240, 90)];
    for seed in 0..20 {
        // Particles are drawn one after the other, so the single particle of one run is the first of 100 in the other.
        let [one, many] = [1, 100].map(|particles| {
            let params = Params {
                particles,
                ..params(seed)
            };
            run(&frames, target, params)[0].target
        });
        assert_eq!(many, one, "seed {seed}");
        assert!(one.center_distance(&target) > 0.0, "seed {seed}");
    }
}

#[test]
fn equal_distances_give_equal_weights() {
    // Of two particles with equal weights the first is the answer. With equal chances, the next answer descends from
    // the answer itself (the variance of its step is that of the motion, 1) or from the second particle (1, and 2 for
    // the difference of the two particles): 2 on average. With all weight on the first particle it would be 1, on the
    // second 3.
    let target = Rect::new(140.0, 100.0, 40.0, 40.0);
    let frames = vec![flat(320, 240, 90); 3];
    let steps = (0..600).flat_map(|seed| {
        let params = Params {
            particles: 2,
            motion_std_x: 5.0,
            motion_std_y: 5.0,
            motion_std_scale: 0.0,
            ..params(seed)
        };
        let answers = run(&frames, target, params);
        let (from, to) = (answers[0].target, answers[1].target);
        [(to.x - from.x) / 5.0, (to.y - from.y) / 5.0]
    });
    let steps: Vec<f64> = steps.collect();
    let variance = steps.iter().map(|step| step * step).sum::<f64>() / steps.len() as f64;
    println!("variance {variance:.3}");
    assert!((variance - 2.0).abs() < 0.4, "{variance}");
}

#[test]
fn nothing_draws_the_box_away_where_nothing_can_be_told_apart() {
    // All places look alike, so the prior on the displacement decides, which prefers the last place.
    let target = Rect::new(140.0, 100.0, 40.0, 40.0);
    for seed in 0..4 {
        for answer in run(&vec![flat(320, 240, 90); 5], target, robust(seed)) {
            let distance = answer.target.center_distance(&target);
            assert!(distance < 0.1, "seed {seed}: {answer:?}");
            assert!(
                (answer.target.width / 40.0 - 1.0).abs() < 0.01,
                "seed {seed}: {answer:?}"
            );
        }
    }
}

#[test]
fn more_basis_vectors_than_patches() {
    let frames: Vec<Frame> = (0..14).map(frame).collect();
    for history in [1, 2] {
        for (_, params) in variants(5) {
            let params = Params {
                basis_dim: 6,
                history,
                ..params
            };
            run(&frames, bagtrack_testing::scene::target(0), params);
        }
    }
}

#[test]
fn the_smallest_parameters_and_no_motion() {
    let frames: Vec<Frame> = (0..14).map(frame).collect();
    let params = Params {
        particles: 1,
        patch_width: 4,
        patch_height: 4,
        basis_dim: 1,
        history: 1,
        bag_size: 1,
        update_every: 1,
        motion_std_x: 0.0,
        motion_std_y: 0.0,
        motion_std_scale: 0.0,
        ..params(6)
    };
    for answer in run(&frames, bagtrack_testing::scene::target(0), params) {
        assert!(
            answer
                .target
                .center_distance(&bagtrack_testing::scene::target(0))
                < 1e-9
        );
    }
}

#[test]
fn a_sigma_that_underflows_every_plain_likelihood() {
    let frames: Vec<Frame> = (0..10).map(frame).collect();
    for (_, params) in variants(7) {
        let params = Params {
            sigma: 1e-4,
            ..params
        };
        run(&frames, bagtrack_testing::scene::target(0), params);
    }
}

#[test]
fn walks_and_scales_without_bound_are_held() {
    let frames: Vec<Frame> = (0..30).map(frame).collect();
    let edge = Rect::new(0.0, 0.0, 120.0, 90.0);
    for (name, params) in variants(8) {
        let params = Params {
            motion_std_x: 320.0,
            motion_std_y: 320.0,
            motion_std_scale: 1.0,
            displacement_std: 0.0,
            ..params
        };
        for answer in run(&frames, bagtrack_testing::scene::target(0), params) {
            assert!(
                answer.target.intersection(&edge).area() > 0.0,
                "{name}: {answer:?}"
            );
            assert!(answer.target.width < 500.0 && answer.target.height > 0.9);
        }
    }
}

#[test]
fn frames_one_pixel_wide_or_high() {
    for (width, height) in [(1, 60), (60, 1), (1, 1), (1, 4000), (4000, 1)] {
        let pixels = (0..width * height).map(|i| (i * 37 % 251) as u8).collect();
        let frame = Frame::from_luma(width, height, pixels).expect("a frame of this size");
        let long = 16.0_f64.max(f64::from(width.max(height)) / 10.0);
        let target = Rect::new(0.0, 0.0, long, long);
        run(&vec![frame; 8], target, params(9));
    }
}

#[test]
fn a_tiny_frame_with_the_largest_box() {
    for (width, height) in [(1, 1), (3, 2), (17, 5), (300, 3), (1, 300)] {
        let frames: Vec<Frame> = (0..12_u32)
            .map(|t| {
                let pixels = (0..width * height).map(|i| ((i + t) * 53 % 251) as u8);
                Frame::from_luma(width, height, pixels.collect()).expect("a frame of this size")
            })
            .collect();
        let side = 4.0 * 4.0_f64.max(f64::from(width.max(height)));
        run_variants(&frames, Rect::centered(0.5, 0.5, side, side), 12);
        run_variants(&frames, Rect::new(0.0, 0.0, side, MIN_BOX_SIDE), 13);
    }
}

#[test]
fn the_smallest_box_and_what_is_below_it() {
    let frames: Vec<Frame> = (0..8).map(frame).collect();
    let least = MIN_BOX_SIDE;
    run_variants(&frames, Rect::new(30.0, 30.0, least, least), 10);
    let refused = |target| match Tracker::new(&frames[0], target, params(10)) {
        Err(TrackerError::Target(why)) => why,
        other => panic!("{target:?}: {other:?}"),
    };
    assert!(refused(Rect::new(30.0, 30.0, least - 0.01, 9.0)).contains("too small"));
    assert!(refused(Rect::new(30.0, 30.0, 9.0, 0.0)).contains("too small"));
    assert!(refused(Rect::new(30.0, 30.0, 9.0, -5.0)).contains("too small"));
    assert!(refused(Rect::new(0.0, 0.0, 481.0, 9.0)).contains("too large"));
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(refused(Rect::new(value, 0.0, 9.0, 9.0)).contains("not finite"));
        assert!(refused(Rect::new(0.0, 0.0, 9.0, value)).contains("not finite"));
    }
}

#[test]
fn boxes_partly_and_wholly_outside() {
    let frames: Vec<Frame> = (0..8).map(frame).collect();
    for (x, y) in [(-19.0, 20.0), (119.0, 89.0), (30.0, -19.0), (-19.0, 89.0)] {
        run_variants(&frames, Rect::new(x, y, 20.0, 20.0), 11);
    }
    for (x, y) in [
        (-20.0, 20.0),
        (120.0, 20.0),
        (30.0, 90.0),
        (-1e300, 0.0),
        (0.0, 1e300),
    ] {
        let target = Rect::new(x, y, 20.0, 20.0);
        match Tracker::new(&frames[0], target, params(11)) {
            Err(TrackerError::Target(why)) => assert!(why.contains("outside"), "{why}"),
            other => panic!("{target:?}: {other:?}"),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_small_frames_and_any_box_give_an_answer_or_a_typed_error(
        width in 1_u32..40,
        height in 1_u32..40,
        luma in proptest::collection::vec(any::<u8>(), 1..200),
        x in -30.0_f64..50.0,
        y in -30.0_f64..50.0,
        box_width in 0.0_f64..60.0,
        box_height in 0.0_f64..60.0,
        seed: u64,
    ) {
        let frames: Vec<Frame> = (0..7)
            .map(|t| {
                let pixel = |i| luma[(i as usize * (t + 1)) % luma.len()];
                let pixels = (0..width * height).map(pixel).collect();
                Frame::from_luma(width, height, pixels).expect("a frame of this size")
            })
            .collect();
        let target = Rect::new(x, y, box_width, box_height);
        if Tracker::new(&frames[0], target, params(seed)).is_ok() {
            run_variants(&frames, target, seed);
        }
    }
}
