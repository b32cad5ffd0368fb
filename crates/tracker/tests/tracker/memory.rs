//! The memory that a session keeps between frames, counted by the allocator.

use bagtrack_testing::scene::{panned, robust};
use bagtrack_tracker::{Params, Preset, Tracker};

/// The bytes of heap memory that dropping `tracker` frees.
fn heap(tracker: Tracker) -> usize {
    let counted = allocation_counter::measure(|| drop(tracker));
    usize::try_from(-counted.bytes_current).expect("dropping gives back")
}

/// A tracker after `steps` frames; 75 fill the bag, and renew the background samples several times.
fn session(params: Params, steps: usize) -> Tracker {
    let (frame, target) = panned(0, (0, 0));
    let mut tracker = Tracker::new(&frame, target, params).expect("a box inside the frame");
    for t in 1..=steps {
        let (frame, target) = panned(t, (0, 0));
        let answer = match t % 40 {
            0 => tracker.retarget(&frame, target),
            _ => tracker.step(&frame),
        };
        answer.expect("frames of one size");
    }
    tracker
}

#[test]
fn a_session_keeps_no_more_than_a_quarter_of_a_mebibyte_and_no_snapshot_asks_for_more() {
    const LIMIT: usize = 256 * 1024;
    for params in [Preset::Paper.params(), robust(0)] {
        // Makes the thread's own buffers first: they are no part of a session.
        drop(session(params.clone(), 2));
        for steps in [0, 75] {
            let tracker = session(params.clone(), steps);
            let snapshot = tracker.snapshot();
            let restored = Tracker::restore(&snapshot).expect("an own snapshot");
            let (kept, kept_restored) = (heap(tracker), heap(restored));
            println!(
                "{} particles, {steps} frames: snapshot {} bytes, heap {kept} bytes, restored {kept_restored} bytes",
                params.particles,
                snapshot.len()
            );
            assert!(snapshot.len() <= LIMIT);
            assert!(kept <= LIMIT && kept_restored <= LIMIT);
            assert!(
                kept > 3 * snapshot.len() / 4,
                "the count is of this tracker"
            );
        }
    }

    // Writes a huge length over the snapshot at many places: restoring must not allocate for lengths that the bytes do
    // not hold.
    let body = session(robust(0), 1).snapshot();
    let mut most = 0;
    let endless = [0xff, 0xff, 0xff, 0xff, 0x0f];
    for at in (16..body.len() - endless.len()).step_by(7).chain(16..900) {
        let mut bytes = body.clone();
        bytes[at..at + endless.len()].copy_from_slice(&endless);
        let checksum = crc32fast::hash(&bytes[16..]).to_le_bytes();
        bytes[12..16].copy_from_slice(&checksum);
        let counted = allocation_counter::measure(|| drop(Tracker::restore(&bytes)));
        most = most.max(counted.bytes_max);
    }
    println!("hostile lengths: {most} bytes at most");
    assert!(most < 16 << 20);
}
