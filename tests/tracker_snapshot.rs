//! Snapshots: a restored tracker goes on bit for bit, and no bytes can harm the program.

mod tracker_scene;

use bagtrack::tracker::{Params, Tracker, TrackerError};
use proptest::prelude::*;
use tracker_scene::{frame, params, target};

/// A session of some frames, with vectors short enough that random damage hits everything.
fn session(steps: usize) -> Tracker {
    let params = Params {
        particles: 6,
        patch_width: 4,
        patch_height: 4,
        bag_size: 3,
        update_every: 2,
        ..params(11)
    };
    let mut tracker = Tracker::new(&frame(0), target(0), params).expect("a box inside the frame");
    for t in 1..=steps {
        tracker
            .step(&frame(t))
            .expect("a frame of the session's size");
    }
    tracker
}

/// `body` with the header that makes it look like a snapshot.
fn sealed(body: &[u8]) -> Vec<u8> {
    let mut bytes = b"BAGTRACK\x01\0\0\0".to_vec();
    bytes.extend_from_slice(&crc32fast::hash(body).to_le_bytes());
    bytes.extend_from_slice(body);
    bytes
}

#[test]
fn a_restored_tracker_goes_on_bit_for_bit() {
    for steps in [0, 1, 4, 12, 60] {
        let mut tracker =
            Tracker::new(&frame(0), target(0), params(9)).expect("a box in the frame");
        for t in 1..=steps {
            tracker
                .step(&frame(t))
                .expect("a frame of the session's size");
        }
        let bytes = tracker.snapshot();
        let mut restored = Tracker::restore(&bytes).expect("an own snapshot");
        assert_eq!(restored.snapshot(), bytes);
        assert_eq!(restored.estimate(), tracker.estimate());
        assert_eq!(restored.params(), tracker.params());
        assert_eq!(restored.source_size(), tracker.source_size());
        for t in steps + 1..steps + 15 {
            assert_eq!(restored.step(&frame(t)), tracker.step(&frame(t)));
        }
        let corrected = target(steps + 15);
        assert_eq!(
            restored.retarget(&frame(steps + 15), corrected),
            tracker.retarget(&frame(steps + 15), corrected)
        );
        assert_eq!(restored.snapshot(), tracker.snapshot());
        assert!(bytes.len() < 512 * 1024, "{} bytes", bytes.len());
    }
}

#[test]
fn damage_of_any_byte_and_every_cut_is_found() {
    let bytes = session(5).snapshot();
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

#[test]
fn another_version_is_named() {
    let mut bytes = session(1).snapshot();
    bytes[8] ^= 0x80;
    let error = Tracker::restore(&bytes).expect_err("not this version");
    assert_eq!(error.to_string(), "the snapshot is of another version");
}

/// What is accepted must go on: every answer finite, every snapshot acceptable again.
fn must_go_on(bytes: &[u8]) {
    let Ok(mut tracker) = Tracker::restore(bytes) else {
        return;
    };
    let (width, height) = tracker.source_size();
    if u64::from(width) * u64::from(height) > 1 << 20 {
        return;
    }
    for value in [0, 200] {
        let answer = tracker
            .step(&tracker_scene::flat(width, height, value))
            .expect("a frame of the session's size");
        assert!(answer.target.is_valid(), "{answer:?}");
        assert!((0.0..=1.0).contains(&answer.score), "{answer:?}");
        Tracker::restore(&tracker.snapshot()).expect("an own snapshot");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn changed_bytes_under_a_right_checksum_never_harm(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        early in any::<bool>(),
    ) {
        let mut body = session(5).snapshot().split_off(16);
        for (index, value) in changes {
            // The parameters, sizes and numbers come first; the vectors would drown them.
            let at = index.index(if early { 400 } else { body.len() });
            body[at] = value;
        }
        must_go_on(&sealed(&body));
    }

    #[test]
    fn any_bytes_under_a_right_checksum_never_harm(body in proptest::collection::vec(any::<u8>(), 0..300)) {
        must_go_on(&sealed(&body));
        must_go_on(&body);
    }
}
