//! After warm-up a step allocates hardly anything: counted by an allocator that counts.

use bagtrack::tracker::{GrayFrame, Params, Preset, Rect, Tracker};

/// The answer's vector, the history's slices and sums of weights, the new entry in the frames that have one, and the
/// matrix product's room for its blocks: none of them grows with the number of frames.
const MOST_A_STEP: u64 = 12;

fn frame(t: usize) -> GrayFrame {
    let pixel = |x: usize, y: usize| ((x + t) * 7 % 31 * 5 + (y * 11 + t * 3) % 97) as u8;
    let luma = (0..160 * 120).map(|i| pixel(i % 160, i / 160)).collect();
    GrayFrame::from_luma(160, 120, luma).expect("a frame of this size")
}

fn tracker(params: Params) -> Tracker {
    Tracker::new(&frame(0), Rect::new(50.0, 40.0, 40.0, 30.0), params).expect("a box in the frame")
}

/// The number of allocations of frames `from` to `until`.
fn allocations(tracker: &mut Tracker, from: usize, until: usize) -> u64 {
    let frames: Vec<GrayFrame> = (from..until).map(frame).collect();
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

#[test]
fn a_warm_step_allocates_a_few_times_only() {
    let mut tracker = tracker(Preset::Paper.params());
    assert!(allocations(&mut tracker, 1, 60) > 0, "it warms up");
    // Bag updates included, which also replace the oldest entry.
    for from in (60..90).step_by(5) {
        let counted = allocations(&mut tracker, from, from + 5);
        assert!(counted <= 5 * MOST_A_STEP, "{counted} in five steps");
    }
}

#[test]
fn a_session_keeps_no_more_than_its_state() {
    let mut trackers = vec![tracker(Preset::Paper.params())];
    allocations(&mut trackers[0], 1, 60);
    let counted = allocation_counter::measure(|| trackers.push(trackers[0].clone()));
    let bytes = counted.bytes_current;
    assert!((1..=256 * 1024).contains(&bytes), "{bytes} bytes");
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
