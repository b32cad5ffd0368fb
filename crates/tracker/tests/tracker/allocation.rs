//! After some frames of warm-up, a step allocates nothing, as a counting allocator shows.

use bagtrack_testing::scene::{near, panned};
use bagtrack_tracker::{Frame, Params, Preset, Rect, Status, Tracker};

/// A scene whose target is held: where a target is not held, the bag fills later, and allocates meanwhile.
fn frame(t: usize) -> Frame {
    panned(t, (0, 0)).0
}

fn tracker(params: Params) -> Tracker {
    let (frame, target) = panned(0, (0, 0));
    Tracker::new(&frame, target, params).expect("a box in the frame")
}

/// The number of allocations in the steps of frames `from` to `until`, the last excluded.
fn allocations(tracker: &mut Tracker, from: usize, until: usize) -> u64 {
    let frames: Vec<Frame> = (from..until).map(frame).collect();
    let counted = allocation_counter::measure(|| {
        for frame in &frames {
            tracker.step(frame).expect("frames of one size");
        }
    });
    counted.count_total
}

#[test]
fn the_counter_counts() {
    let counted = allocation_counter::measure(|| drop(std::hint::black_box(vec![0_u8; 100])));
    assert_eq!(counted.count_total, 1);
}

/// Among the counted frames are some in which the bag replaces an entry, and some in which the background samples are
/// renewed.
#[test]
fn a_warm_step_allocates_nothing() {
    for preset in [Preset::Paper, Preset::Robust] {
        let mut tracker = tracker(preset.params());
        assert!(allocations(&mut tracker, 1, 70) > 0, "it warms up");
        for t in 70..110 {
            let counted = allocations(&mut tracker, t, t + 1);
            assert_eq!(counted, 0, "{preset:?}, frame {t}");
        }
    }
}

/// A large target is tracked in a working image of larger pixels.
#[test]
fn a_warm_step_of_a_large_target_allocates_nothing() {
    let scene = |t| near(t, (110, 96));
    let (first, target) = scene(0);
    let mut tracker = Tracker::new(&first, target, Preset::Robust.params()).expect("a box inside");
    for t in 1..110 {
        let (frame, _) = scene(t);
        let counted = allocation_counter::measure(|| {
            tracker.step(&frame).expect("frames of one size");
        });
        assert!(t < 70 || counted.count_total == 0, "frame {t}");
    }
}

/// The same scene in colour: chroma has its own channels, and the colour histogram has another size.
fn colored(t: usize) -> Frame {
    let luma = frame(t);
    let rgb: Vec<u8> = luma
        .pixels()
        .iter()
        .flat_map(|&value| [value, value / 2, 255 - value])
        .collect();
    Frame::from_rgb(luma.width(), luma.height(), &rgb).expect("a frame of this size")
}

#[test]
fn a_warm_step_in_colour_allocates_nothing() {
    let (_, target) = panned(0, (0, 0));
    let params = Preset::Robust.params();
    let mut tracker = Tracker::new(&colored(0), target, params).expect("a box in the frame");
    for t in 1..110 {
        let frame = colored(t);
        let counted = allocation_counter::measure(|| {
            tracker.step(&frame).expect("frames of one size");
        });
        assert!(t < 70 || counted.count_total == 0, "frame {t}");
    }
}

/// While the target is lost, the search area grows from frame to frame, up to its limit.
#[test]
fn the_search_for_a_lost_target_allocates_nothing() {
    let mut tracker = tracker(Preset::Robust.params());
    allocations(&mut tracker, 1, 70);
    let gone = bagtrack_testing::scene::flat(frame(0).width(), frame(0).height(), 90);
    for t in 70..100 {
        let counted = allocation_counter::measure(|| {
            let estimate = tracker.step(&gone).expect("frames of one size");
            assert!(t < 75 || estimate.status == Status::Lost, "frame {t}");
        });
        assert_eq!(counted.count_total, 0, "frame {t}");
    }
}

/// A thread that has warmed up for one session needs no warm-up for the next of its kind: only that session's own state
/// is allocated.
#[test]
fn sessions_of_one_kind_in_turns_allocate_nothing() {
    let mut trackers = [0, 1].map(|seed| {
        tracker(Params {
            seed,
            ..Preset::Robust.params()
        })
    });
    for tracker in &mut trackers {
        allocations(tracker, 1, 70);
    }
    for t in 70..90 {
        for tracker in &mut trackers {
            assert_eq!(allocations(tracker, t, t + 1), 0, "frame {t}");
        }
    }
}

#[test]
fn a_session_keeps_no_more_than_its_state() {
    for (preset, limit) in [(Preset::Paper, 256), (Preset::Robust, 256)] {
        let mut trackers = vec![tracker(preset.params())];
        allocations(&mut trackers[0], 1, 70);
        let counted = allocation_counter::measure(|| trackers.push(trackers[0].clone()));
        let bytes = counted.bytes_current;
        assert!((1..=limit * 1024).contains(&bytes), "{bytes} bytes");
    }
}

#[test]
fn sessions_that_share_a_thread_do_not_share_anything_else() {
    let small = Params {
        particles: 20,
        patch_width: 9,
        patch_height: 12,
        basis_dim: 2,
        history: 3,
        bag_size: 4,
        update_every: 2,
        alpha: 0.3,
        ..Preset::Paper.params()
    };
    let settings = [Preset::Paper.params(), small];
    let alone: Vec<Vec<Rect>> = settings
        .iter()
        .map(|params| {
            let mut tracker = tracker(params.clone());
            let step = |t| tracker.step(&frame(t)).expect("frames of one size").target;
            (1..40).map(step).collect()
        })
        .collect();
    let mut together = settings.map(tracker);
    for t in 1..40 {
        for (tracker, alone) in together.iter_mut().zip(&alone) {
            let target = tracker.step(&frame(t)).expect("frames of one size").target;
            assert_eq!(target, alone[t - 1], "frame {t}");
        }
    }
}
