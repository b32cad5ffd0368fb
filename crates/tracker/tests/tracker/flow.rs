//! The tracker through its public surface: what a session may rely on.

use bagtrack_testing::scene::{flat, frame, params, target};
use bagtrack_tracker::{Frame, Params, Preset, Rect, Search, Status, Tracker, TrackerError};

fn start(seed: u64) -> Tracker {
    Tracker::new(&frame(0), target(0), params(seed)).expect("a box inside the frame")
}

#[test]
fn frames_are_counted_and_the_first_answer_is_the_box_given() {
    let mut tracker = start(1);
    let first = tracker.estimate();
    assert_eq!((first.frame, first.target), (0, target(0)));
    assert_eq!(first.status, Status::Tracking);
    assert_eq!(tracker.source_size(), (120, 90));
    for t in 1..5 {
        let answer = tracker
            .step(&frame(t))
            .expect("a frame of the session's size");
        assert_eq!(answer.frame, t as u64);
        assert_eq!(answer, tracker.estimate());
        assert!((0.0..=1.0).contains(&answer.score));
    }
}

#[test]
fn a_target_unlike_its_surroundings_is_followed() {
    // With one previous patch. With five, the printed distance of origins favours candidates that make up for the
    // difference between the last patches and the bag, and the box drifts off even in this scene.
    for seed in 0..5 {
        let params = Params {
            history: 1,
            ..params(seed)
        };
        let mut tracker = Tracker::new(&frame(0), target(0), params).expect("a box in the frame");
        for t in 1..30 {
            let answer = tracker
                .step(&frame(t))
                .expect("a frame of the session's size");
            let distance = answer.target.center_distance(&target(t));
            assert!(distance < 6.0, "seed {seed}, frame {t}: {answer:?}");
        }
    }
}

/// Candidates are diagonalised side by side in buffers of the thread. What another session left there beyond this
/// session's candidates must not change a bit.
#[test]
fn a_printed_search_in_two_stages_does_not_depend_on_what_the_thread_saw_before() {
    let params = Params {
        particles: 7,
        history: 9,
        search: Search::Answer,
        // Small enough that the last bits of a distance show in the weights.
        sigma: 0.0001,
        ..params(0)
    };
    let start = |frame: &Frame| Tracker::new(frame, target(0), params.clone());
    let mut tracker = start(&frame(0)).expect("a box inside the frame");
    let mut other = start(&flat(120, 90, 9)).expect("a box inside the frame");
    for t in 1..30 {
        let mut copy = tracker.clone();
        assert!(copy.step(&frame(t)).is_ok());
        assert!(other.step(&flat(120, 90, 9)).is_ok());
        assert!(tracker.step(&frame(t)).is_ok());
        assert!(tracker.snapshot() == copy.snapshot(), "frame {t}");
    }
}

/// A small target with red and blue stripes, which turns by one degree a frame and moves right, before a background of
/// grains of all colours.
fn turning(t: usize) -> Frame {
    let (x, y) = turning_target(t).center();
    let (sin, cos) = (t as f64).to_radians().sin_cos();
    let pixel = |i: usize| {
        let (column, row) = (i % 320, i / 320);
        let (dx, dy) = (column as f64 + 0.5 - x, row as f64 + 0.5 - y);
        let (along, across) = (cos * dx + sin * dy, cos * dy - sin * dx);
        if along.abs() < 17.0 && across.abs() < 14.0 {
            let is_light = (along / 6.0).floor().rem_euclid(2.0) == 0.0;
            return if is_light {
                [220, 60, 30]
            } else {
                [40, 20, 140]
            };
        }
        let grain = |factor: usize| (column / 3 * factor + row / 3 * 31 + column * row / 40) % 160;
        [grain(7), grain(13), grain(29)].map(|value| 40 + value as u8)
    };
    let rgb: Vec<u8> = (0..320 * 180).flat_map(pixel).collect();
    Frame::from_rgb(320, 180, &rgb).expect("a frame of this size")
}

fn turning_target(t: usize) -> Rect {
    Rect::new(60.0 + t as f64, 70.0, 34.0, 28.0)
}

/// A turned target is evaluated in a view of a part of the frame, which is made in a buffer of the thread. What another
/// session left around that part must not change a bit.
#[test]
fn a_turned_target_does_not_depend_on_what_the_thread_saw_before() {
    let run = || {
        let params = Preset::Robust.params();
        let tracker = Tracker::new(&turning(0), turning_target(0), params);
        let mut tracker = tracker.expect("a box in the frame");
        (1..60)
            .map(|t| tracker.step(&turning(t)).expect("frames of one size"))
            .collect()
    };
    let fresh = || std::thread::spawn(run).join().expect("it ends");
    let (alone, again): (Vec<_>, Vec<_>) = (
        fresh(),
        std::thread::spawn(move || {
            let _: Vec<_> = run();
            run()
        })
        .join()
        .expect("it ends"),
    );
    let overlap = alone[58].target.overlap(&turning_target(59));
    assert!(overlap > 0.6, "{overlap}: it is not followed");
    assert_eq!(alone, again);
}

#[test]
fn a_frame_of_another_size_changes_nothing() {
    let mut tracker = start(4);
    tracker
        .step(&frame(1))
        .expect("a frame of the session's size");
    let before = tracker.snapshot();
    let error = TrackerError::FrameSize {
        width: 120,
        height: 90,
        got_width: 90,
        got_height: 120,
    };
    assert_eq!(tracker.step(&flat(90, 120, 3)), Err(error.clone()));
    assert_eq!(tracker.retarget(&flat(90, 120, 3), target(2)), Err(error));
    let outside = Rect::new(500.0, 0.0, 20.0, 20.0);
    assert!(matches!(
        tracker.retarget(&frame(2), outside),
        Err(TrackerError::Target(_))
    ));
    assert_eq!(tracker.snapshot(), before);
}

#[test]
fn a_corrected_box_counts_as_a_frame_and_is_followed_from_there() {
    // With one previous patch: with five the box drifts off in this scene.
    let params = Params {
        history: 1,
        ..params(5)
    };
    let mut tracker = Tracker::new(&frame(0), target(0), params).expect("a box in the frame");
    for t in 1..8 {
        tracker
            .step(&frame(t))
            .expect("a frame of the session's size");
    }
    let wider = Rect::new(target(30).x - 2.0, target(30).y - 3.0, 28.0, 26.0);
    let answer = tracker
        .retarget(&frame(30), wider)
        .expect("a box inside the frame");
    assert_eq!((answer.frame, answer.target, answer.score), (8, wider, 1.0));
    for t in 31..43 {
        let next = tracker
            .step(&frame(t))
            .expect("a frame of the session's size");
        assert_eq!(next.frame, t as u64 - 22);
        let distance = next.target.center_distance(&target(t));
        assert!(distance < 8.0, "{next:?}");
        let aspect = next.target.width / next.target.height;
        assert!(
            (aspect - 28.0 / 26.0).abs() < 1e-9,
            "the new aspect is kept"
        );
    }
}

#[test]
fn boxes_are_in_the_pixels_of_the_upload() {
    // The same scene in four times the size: the working image is the same, so the answers are the same boxes, four
    // times as large.
    let large = |t: usize| {
        let small = frame(t);
        let wide = 480;
        let luma = (0..wide * 360)
            .map(|i| small.pixels()[i / wide / 4 * 120 + i % wide / 4])
            .collect();
        Frame::from_luma(480, 360, luma).expect("a frame of this size")
    };
    let start = target(0).scaled(4.0, 4.0);
    let mut tracker = Tracker::new(&large(0), start, params(6)).expect("a box inside the frame");
    assert_eq!(tracker.frame_format().size, (320, 240));
    assert_eq!(tracker.estimate().target, start);
    for t in 1..10 {
        let answer = tracker
            .step(&large(t))
            .expect("a frame of the session's size");
        let truth = target(t).scaled(4.0, 4.0);
        let distance = answer.target.center_distance(&truth);
        assert!(distance < 12.0, "{t}: {answer:?}");
        assert!((answer.target.width / truth.width - 1.0).abs() < 0.3);
    }
}

/// The preset `robust` with one parameter of the table set to `value`; `None` where its type cannot hold the value.
fn with(name: &str, value: f64) -> Option<Params> {
    let mut fields = serde_json::to_value(Preset::Robust.params()).expect("plain numbers");
    let is_whole = fields[name].is_u64();
    if is_whole && value < 0.0 {
        return None;
    }
    fields[name] = match is_whole {
        true => (value as u64).into(),
        false => value.into(),
    };
    Some(serde_json::from_value(fields).expect("a value of the field's type"))
}

#[test]
fn every_parameter_of_the_table_is_held_to_its_range() {
    let ranged = Params::TABLE
        .iter()
        .filter_map(|row| Some((row, row.range?)));
    assert_eq!(ranged.clone().count() + 1, Params::TABLE.len());
    for (row, (min, max)) in ranged {
        let step = if row.kind == "u32" { 1.0 } else { 1e-9 };
        for value in [min, max] {
            let params = with(row.name, value).expect("an end of the range");
            // A value in its range may still exceed a limit on products of parameters.
            if let Err(error) = params.validate() {
                assert!(error.expected.contains("times"), "{error}");
            }
        }
        for value in [min - step, max + step] {
            let Some(params) = with(row.name, value) else {
                continue;
            };
            match Tracker::new(&frame(0), target(0), params) {
                Err(TrackerError::Params(error)) => {
                    assert_eq!((error.name, error.value), (row.name, value));
                    assert!(error.to_string().contains(error.expected));
                }
                other => panic!("{} = {value}: {other:?}", row.name),
            }
        }
    }
    for preset in [Preset::Paper, Preset::Robust] {
        assert_eq!(preset.params().validate(), Ok(()));
    }
}

/// Each size is in its range, but their product is too large: a frame would take seconds, or a session a hundred
/// megabytes.
#[test]
fn sizes_that_cost_too_much_together_are_named() {
    type Change = fn(&mut Params);
    let cases: [(&str, Change); 4] = [
        ("particles", |p| (p.patch_width, p.patch_height) = (64, 64)),
        ("bag_size", |p| {
            (p.patch_width, p.patch_height) = (64, 64);
            (p.particles, p.background_samples) = (22, 256);
        }),
        ("bag_size", |p| {
            (p.patch_width, p.patch_height, p.particles) = (32, 32, 80);
            (p.bag_size, p.basis_dim) = (32, 6);
        }),
        ("background_samples", |p| {
            (p.particles, p.background_samples) = (1000, 256);
        }),
    ];
    for (name, change) in cases {
        let mut params = Preset::Robust.params();
        change(&mut params);
        match Tracker::new(&frame(0), target(0), params) {
            Err(TrackerError::Params(error)) => {
                assert_eq!(error.name, name);
                assert!(error.to_string().contains(error.expected));
            }
            other => panic!("{name}: {other:?}"),
        }
    }
}
