//! Snapshots: a restored tracker goes on bit for bit, and no bytes make the program fail.

use bagtrack_testing::scene::{frame, params, robust, target};
use bagtrack_tracker::{Frame, Params, Tracker, TrackerError};
use proptest::prelude::*;

/// A session of `steps` frames, with vectors so short that random damage hits all parts of the snapshot.
fn session(steps: usize, params: Params) -> Tracker {
    let params = Params {
        particles: 6,
        patch_width: 4,
        patch_height: 4,
        bag_size: 3,
        update_every: 2,
        ..params
    };
    let mut tracker = Tracker::new(&frame(0), target(0), params).expect("a box inside the frame");
    for t in 1..=steps {
        tracker
            .step(&frame(t))
            .expect("a frame of the session's size");
    }
    tracker
}

/// As [`session`], with the extensions of the preset `robust`.
fn extended(steps: usize) -> Tracker {
    let params = Params {
        background_samples: 5,
        ..robust(11)
    };
    session(steps, params)
}

/// `body` with the header of a snapshot and a right checksum.
fn sealed(body: &[u8]) -> Vec<u8> {
    let mut bytes = session(0, params(11)).snapshot();
    bytes.truncate(12);
    bytes.extend_from_slice(&crc32fast::hash(body).to_le_bytes());
    bytes.extend_from_slice(body);
    bytes
}

/// The body of the tracker's snapshot, without header and checksum.
fn body(tracker: &Tracker) -> Vec<u8> {
    let snapshot = tracker.snapshot();
    assert_eq!(sealed(&snapshot[16..]), snapshot);
    snapshot[16..].to_vec()
}

/// Steps `tracker` and a copy restored from its snapshot, corrects both, and compares every bit.
fn goes_on_bit_for_bit(tracker: &mut Tracker, from: usize) {
    let bytes = tracker.snapshot();
    assert!(bytes.len() <= 512 * 1024, "{} bytes", bytes.len());
    let mut restored = Tracker::restore(&bytes).expect("an own snapshot");
    assert!(restored.snapshot() == bytes);
    assert_eq!(restored.estimate(), tracker.estimate());
    assert_eq!(restored.params(), tracker.params());
    assert_eq!(restored.source_size(), tracker.source_size());
    for t in from + 1..from + 15 {
        assert_eq!(restored.step(&frame(t)), tracker.step(&frame(t)), "{t}");
    }
    let (frame, corrected) = (frame(from + 15), target(from + 15));
    assert_eq!(
        restored.retarget(&frame, corrected),
        tracker.retarget(&frame, corrected)
    );
    assert!(restored.snapshot() == tracker.snapshot());
}

/// The frames go past a renewal of the background samples (every tenth frame) and past new entries of the bag.
#[test]
fn a_tracker_restored_near_another_goes_on_bit_for_bit() {
    for params in [params(9), robust(9)] {
        let mut tracker =
            Tracker::new(&frame(0), target(0), params).expect("a box inside the frame");
        let mut behind = tracker.clone();
        for t in 1..25 {
            tracker.step(&frame(t)).expect("a frame of its size");
            let bytes = tracker.snapshot();
            let mut restored = behind.restore_near(&bytes, None).expect("an own snapshot");
            let mut expected = Tracker::restore(&bytes).expect("an own snapshot");
            if t % 3 == 0 {
                behind = restored.clone();
            }
            for t in t + 1..t + 4 {
                assert_eq!(restored.step(&frame(t)), expected.step(&frame(t)), "{t}");
            }
            assert!(restored.snapshot() == expected.snapshot(), "{t}");
        }
        // A tracker with other parameters has nothing to share.
        let other = extended(3).restore_near(&tracker.snapshot(), None);
        let mut other = other.expect("an own snapshot");
        assert_eq!(other.step(&frame(25)), tracker.step(&frame(25)));
    }
}

#[test]
fn a_restored_tracker_goes_on_bit_for_bit() {
    for params in [params(9), robust(9)] {
        let mut tracker =
            Tracker::new(&frame(0), target(0), params).expect("a box inside the frame");
        // Snapshots before, at and after updates of the bag (every 5th frame) and renewals of the background samples
        // (every 10th).
        for t in 0..=71 {
            if t > 0 {
                tracker
                    .step(&frame(t))
                    .expect("a frame of the session's size");
            }
            if [0, 1, 4, 5, 9, 10, 11, 60, 71].contains(&t) {
                goes_on_bit_for_bit(&mut tracker.clone(), t);
            }
        }
        println!("{} bytes", tracker.snapshot().len());
        // Also after a correction, with which each call ends.
        goes_on_bit_for_bit(&mut tracker, 71);
        goes_on_bit_for_bit(&mut tracker, 86);
    }
}

#[test]
fn damage_of_any_byte_and_every_cut_is_found() {
    for tracker in [session(5, params(11)), extended(5)] {
        let bytes = tracker.snapshot();
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            assert!(matches!(
                Tracker::restore(&damaged),
                Err(TrackerError::Snapshot(_))
            ));
            assert!(Tracker::restore(&bytes[..at]).is_err());
        }
        let mut longer = bytes.clone();
        longer.push(0);
        assert!(Tracker::restore(&longer).is_err());
        assert!(
            Tracker::restore(&sealed(&longer[16..])).is_err(),
            "bytes after the state"
        );
    }
}

#[test]
fn another_version_is_named() {
    let mut bytes = session(1, params(11)).snapshot();
    bytes[8] ^= 0x80;
    let error = Tracker::restore(&bytes).expect_err("not this version");
    assert_eq!(error.to_string(), "the snapshot is of another version");
}

/// If the bytes are accepted, the tracker must go on: every answer is finite, and every further snapshot can be
/// restored.
fn must_go_on(bytes: &[u8]) {
    let Ok(mut tracker) = Tracker::restore(bytes) else {
        return;
    };
    let (width, height) = tracker.source_size();
    if u64::from(width) * u64::from(height) > 1 << 20 {
        return;
    }
    let textured = (0..width * height).map(|i| (i * 97 % 251) as u8).collect();
    let textured = Frame::from_luma(width, height, textured).expect("a frame of this size");
    let dark = bagtrack_testing::scene::flat(width, height, 0);
    for frame in [&dark, &textured, &textured, &dark] {
        let answer = tracker.step(frame).expect("a frame of the session's size");
        assert!(answer.target.is_valid(), "{answer:?}");
        assert!((0.0..=1.0).contains(&answer.score), "{answer:?}");
        Tracker::restore(&tracker.snapshot()).expect("an own snapshot");
    }
}

/// Values that are likely to upset calculations.
const HOSTILE: [f32; 12] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    0.0,
    -0.0,
    -1.0,
    1e-45,
    1e-20,
    999.0,
    -999.0,
    1e20,
    f32::MAX,
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn changed_bytes_under_a_right_checksum_never_harm(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        early in any::<bool>(),
    ) {
        for tracker in [session(5, params(11)), extended(5)] {
            let mut body = body(&tracker);
            for (index, value) in &changes {
                // Half of the damage goes into the first 400 bytes, with parameters and sizes: the vectors are so long
                // that few hits would reach these otherwise.
                let at = index.index(if early { 400 } else { body.len() });
                body[at] = *value;
            }
            must_go_on(&sealed(&body));
        }
    }

    #[test]
    fn hostile_numbers_under_a_right_checksum_never_harm(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), 0..HOSTILE.len()), 1..6),
        late in any::<bool>(),
    ) {
        let mut body = body(&extended(5));
        for (index, which) in changes {
            // The last 1200 bytes hold the colours, the small image and the running means.
            let first = if late { body.len() - 1200 } else { 0 };
            let at = first + index.index(body.len() - 4 - first);
            body[at..at + 4].copy_from_slice(&HOSTILE[which].to_le_bytes());
        }
        must_go_on(&sealed(&body));
    }

    #[test]
    fn any_bytes_under_a_right_checksum_never_harm(body in proptest::collection::vec(any::<u8>(), 0..300)) {
        must_go_on(&sealed(&body));
        must_go_on(&body);
    }
}
