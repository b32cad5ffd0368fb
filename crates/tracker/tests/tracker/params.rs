//! Any valid parameters on any small frames give finite answers, which are the same from every copy of the state.

use bagtrack_tracker::{Features, Frame, Params, Preset, Rect, Search, Tracker};
use proptest::prelude::*;

/// Numbers in [0, 1], among them the ends, and numbers whose products underflow.
fn shares() -> impl Strategy<Value = Vec<f64>> {
    let share = prop_oneof![
        2 => Just(0.0),
        2 => Just(1.0),
        1 => Just(1e-200),
        1 => Just(5e-324),
        6 => 0.0_f64..1.0,
    ];
    proptest::collection::vec(share, 34)
}

/// Parameters from anywhere in their ranges, at the given shares of each; sizes stay small, to be quick.
fn spread(shares: &[f64], switches: u8, seed: u64) -> Params {
    let mut shares = shares.iter().copied();
    let mut share = || shares.next().expect("as many shares as parameters");
    let mut count = |from: u32, to: u32| from + (share() * f64::from(to - from)).round() as u32;
    let counts = Params {
        particles: count(1, 21),
        patch_width: count(4, 8),
        patch_height: count(4, 8),
        basis_dim: count(1, 6),
        history: count(1, 10),
        bag_size: count(1, 6),
        update_every: count(1, 4),
        background_samples: count(0, 24),
        ..bagtrack_testing::scene::robust(seed)
    };
    let on = |bit: u8| switches & 1 << bit != 0;
    // For ranges that span orders of magnitude: the share is taken of the logarithm.
    let mut magnitude = |from: f64, to: f64| {
        (from.ln() + share() * (to / from).ln())
            .exp()
            .clamp(from, to)
    };
    let magnitudes = Params {
        sigma: magnitude(0.0001, 100.0),
        ..counts
    };
    Params {
        alpha: share(),
        motion_std_x: 320.0 * share(),
        motion_std_y: 320.0 * share(),
        motion_std_scale: share(),
        context: 0.5 + 2.5 * share(),
        displacement_std: 1000.0 * share(),
        scale_learning_rate: if on(3) { share() } else { 0.0 },
        dense_maxima: seed as u32 % 17,
        static_penalty: if on(5) { 100.0 * share() } else { 0.0 },
        augmentation_angle: if on(4) { 90.0 * share() } else { 0.0 },
        pinned_weight: if on(1) { 100.0 * share() } else { 0.0 },
        update_distance_ratio: 100.0 * (seed % 3) as f64 / 2.0,
        discriminant_weight: 100.0 * (seed % 5) as f64 / 4.0,
        features: if on(0) {
            Features::Gray
        } else {
            Features::Gradients
        },
        single_vector_candidate: on(2),
        search: if on(3) {
            Search::Resampled
        } else {
            Search::Answer
        },
        global_motion: on(4),
        ..magnitudes
    }
}

/// Frame `t`: `luma` as a pattern that shifts from frame to frame, and every fifth frame black.
fn moving(t: usize, width: u32, height: u32, luma: &[u8]) -> Frame {
    let gray = |i: usize| {
        if t % 5 == 3 {
            0
        } else {
            luma[(i + 7 * t) % luma.len()]
        }
    };
    let pixels = (0..(width * height) as usize).map(gray).collect();
    Frame::from_luma(width, height, pixels).expect("a frame of this size")
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_valid_parameters_give_finite_answers_that_depend_on_the_state_alone(
        shares in shares(),
        switches: u8,
        seed: u64,
        (width, height) in (1_u32..48, 1_u32..36),
        luma in proptest::collection::vec(any::<u8>(), 1..400),
        (x, y) in (-20.0_f64..40.0, -20.0_f64..30.0),
        (box_width, box_height) in (4.0_f64..40.0, 4.0_f64..40.0),
    ) {
        let params = spread(&shares, switches, seed);
        prop_assert_eq!(params.validate(), Ok(()));
        let target = Rect::new(x, y, box_width, box_height);
        let frame = |t| moving(t, width, height, &luma);
        let Ok(mut tracker) = Tracker::new(&frame(0), target, params.clone()) else {
            return Ok(());
        };
        // Another session with the same parameters on the same thread must not influence this one.
        let other = Tracker::new(&bagtrack_testing::scene::frame(0), bagtrack_testing::scene::target(0), params);
        let mut other = other.expect("a box inside the frame");
        for t in 1..8 {
            let mut restored = Tracker::restore(&tracker.snapshot()).expect("an own snapshot");
            let answer = if t == 5 {
                prop_assert!(tracker.retarget(&frame(t), target).is_ok());
                restored.retarget(&frame(t), target)
            } else {
                prop_assert!(tracker.step(&frame(t)).is_ok());
                other.step(&bagtrack_testing::scene::frame(t)).expect("a frame of the session's size");
                restored.step(&frame(t))
            };
            let answer = answer.expect("a frame of the session's size");
            prop_assert!(answer.target.is_valid(), "{:?}", answer);
            prop_assert!((0.0..=1.0).contains(&answer.score), "{:?}", answer);
            prop_assert_eq!(answer, tracker.estimate());
            prop_assert!(restored.snapshot() == tracker.snapshot(), "frame {}", t);
        }
    }
}

/// Resampled particles are weighed by the colours around the target: those of another session's target must not count.
#[test]
fn a_session_gives_the_same_answers_after_any_other_on_its_thread() {
    let resampled = Params {
        search: Search::Resampled,
        motion_std_scale: 0.3,
        ..Preset::Robust.params()
    };
    let answers = move || {
        let scene = bagtrack_testing::scene::frame;
        let target = bagtrack_testing::scene::target(0);
        let mut tracker = Tracker::new(&scene(0), target, resampled.clone()).unwrap();
        (1..9)
            .map(|t| tracker.step(&scene(t)).unwrap())
            .collect::<Vec<_>>()
    };
    let alone = std::thread::spawn(answers.clone()).join().unwrap();
    // The other session looks for its target in frames of noise.
    let noise: Vec<u8> = (0..64 * 64_u32)
        .map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    let frame = |t| moving(t, 64, 64, &noise);
    let box_of_other = Rect::new(9.0, 7.0, 30.0, 20.0);
    let mut other = Tracker::new(&frame(0), box_of_other, Preset::Robust.params()).unwrap();
    for t in 1..4 {
        other.step(&frame(t)).unwrap();
    }
    assert_eq!(answers(), alone);
}

#[test]
fn parameters_are_read_and_set_by_name() {
    let mut params = Preset::Robust.params();
    assert_eq!(params.set("particles", 50.0), Some(()));
    assert_eq!(params.set("sigma", 0.5), Some(()));
    assert_eq!((params.particles, params.sigma), (50, 0.5));
    assert_eq!(params.value("particles"), Some(50.0));
    for (name, value) in [
        ("particles", 50.5),
        ("particles", -1.0),
        ("seed", f64::NAN),
        ("features", 1.0),
    ] {
        assert_eq!(params.set(name, value), None, "{name}");
    }
    assert_eq!(params.particles, 50);
    for row in Params::TABLE {
        assert!(params.value(row.name).is_some(), "{}", row.name);
    }
}
