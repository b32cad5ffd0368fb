//! A tracker with an expert beside its particle filter.

use std::sync::{Arc, Mutex};

use bagtrack_testing::scene::{flat, frame, panned, params, robust, target};
use bagtrack_tracker::{Expert, Frame, InDoubt, Rect, Sighting, Status, Tracker, TrackerError};

/// An expert that answers with prescribed boxes and scores for each frame.
#[derive(Debug)]
struct Oracle {
    /// The box and the score that it answers for each frame; with `None` it answers with the place where it was asked
    /// to look, and 0.9.
    says: fn(usize) -> Option<(Rect, f32)>,
    /// The number of the next frame, and the places where it was asked to look.
    asked: Mutex<(usize, Vec<Rect>)>,
    fingerprint: u64,
}

impl Oracle {
    fn new(says: fn(usize) -> Option<(Rect, f32)>) -> Arc<Self> {
        Arc::new(Self {
            says,
            asked: Mutex::default(),
            fingerprint: 7,
        })
    }

    /// From now on it answers for frame `number`.
    fn at(&self, number: usize) {
        self.asked.lock().unwrap().0 = number;
    }

    fn last_place(&self) -> Rect {
        *self.asked.lock().unwrap().1.last().expect("it was asked")
    }
}

impl Expert for Oracle {
    fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    fn template_len(&self) -> usize {
        4
    }

    fn start(&self, _: &Frame, target: &Rect) -> Vec<f32> {
        [target.x, target.y, target.width, target.height]
            .map(|it| it as f32)
            .to_vec()
    }

    fn look(&self, frame: &Frame, template: &[f32], place: &Rect) -> Sighting {
        assert_eq!(template.len(), 4);
        let mut asked = self.asked.lock().unwrap();
        asked.1.push(*place);
        let working = f64::from(frame.width()) / f64::from(frame.source_size().0);
        let said = (self.says)(asked.0);
        let (target, score) = said.map_or((*place, 0.9), |(target, score)| {
            (target.scaled(working, working), score)
        });
        Sighting { target, score }
    }
}

fn tracker(expert: &Arc<Oracle>) -> Tracker {
    let expert: Arc<dyn Expert> = expert.clone();
    Tracker::beside(&frame(0), target(0), robust(3), Some(expert)).unwrap()
}

#[test]
fn an_expert_that_agrees_changes_little_and_makes_the_score_sure() {
    let expert = Oracle::new(|t| Some((target(t), 0.95)));
    let mut both = tracker(&expert);
    for t in 1..12 {
        expert.at(t);
        let answer = both.step(&frame(t)).unwrap();
        assert!(
            answer.target.overlap(&target(t)) > 0.75,
            "frame {t}: {answer:?}"
        );
        assert!(
            answer.score > 0.8 && answer.status == Status::Tracking,
            "{answer:?}"
        );
    }
}

/// In blank frames the filter finds nothing: the answer is then the expert's, and after some frames the filter goes on
/// from the expert's place.
#[test]
fn where_the_filter_doubts_the_answer_is_the_experts_and_then_the_filter_follows() {
    let expert = Oracle::new(|t| Some((target(if t < 70 { t } else { 5 }), 0.9)));
    let shown = |t: usize| panned(t, (0, 0)).0;
    let shared: Arc<dyn Expert> = expert.clone();
    let mut both = Tracker::beside(&shown(0), target(0), robust(3), Some(shared)).unwrap();
    let mut alone = Tracker::new(&shown(0), target(0), robust(3)).unwrap();
    for t in 1..70 {
        expert.at(t);
        both.step(&shown(t)).unwrap();
        alone.step(&shown(t)).unwrap();
    }
    let mut doubted = 0;
    let gone = flat(200, 160, 90);
    for t in 70..100 {
        expert.at(t);
        let answer = both.step(&gone).unwrap();
        let by_itself = alone.step(&gone).unwrap();
        if by_itself.score < 0.9 {
            doubted += 1;
            let overlap = answer.target.overlap(&target(5));
            assert!(overlap > 0.75, "frame {t}: {answer:?}");
        }
    }
    assert!(doubted > 10, "{doubted}");
    // The target is visible again where the expert saw it, too far away for the filter alone.
    let found = both.step(&shown(5)).unwrap();
    let missed = alone.step(&shown(5)).unwrap();
    assert!(found.target.overlap(&target(5)) > 0.6, "{found:?}");
    assert!(
        missed.target.overlap(&target(5)) < found.target.overlap(&target(5)),
        "{missed:?}"
    );
}

#[test]
fn an_expert_that_went_elsewhere_is_put_back_where_the_filter_is_sure() {
    let expert = Oracle::new(|t| (t == 3).then_some((Rect::new(2.0, 2.0, 20.0, 20.0), 0.1)));
    let mut both = tracker(&expert);
    for t in 1..6 {
        expert.at(t);
        let answer = both.step(&frame(t)).unwrap();
        assert!(
            answer.target.overlap(&target(t)) > 0.6,
            "frame {t}: {answer:?}"
        );
    }
    let place = expert.last_place();
    let working = f64::from(both.frame_format().size.0) / f64::from(both.source_size().0);
    let place = place.scaled(1.0 / working, 1.0 / working);
    assert!(place.center_distance(&target(4)) < 12.0, "{place:?}");
}

#[test]
fn an_expert_for_doubt_is_asked_there_alone_and_looks_where_the_filter_was_last() {
    let expert = Oracle::new(|t| Some((target(t), 0.9)));
    let in_doubt: Arc<dyn Expert> = Arc::new(InDoubt(expert.clone()));
    let shown = |t: usize| panned(t, (0, 0)).0;
    let mut both =
        Tracker::beside(&shown(0), target(0), robust(3), Some(in_doubt.clone())).unwrap();
    let mut alone = Tracker::new(&shown(0), target(0), robust(3)).unwrap();
    let looks = || expert.asked.lock().unwrap().1.len();
    let at_first = looks();
    let gone = flat(200, 160, 90);
    let mut last = both.estimate().target;
    let mut is_asked = false;
    let mut unasked = 0;
    for t in 1..60 {
        expert.at(t);
        let before = looks();
        let picture = if t < 40 { shown(t) } else { gone.clone() };
        let answer = both.step(&picture).unwrap();
        if is_asked {
            continue;
        }
        // Until the expert is first asked, both trackers give the same answers.
        let by_itself = alone.step(&picture).unwrap();
        is_asked = by_itself.score < 0.95;
        assert_eq!(looks() - before, usize::from(is_asked), "frame {t}");
        if is_asked {
            let working = f64::from(both.frame_format().size.0) / f64::from(both.source_size().0);
            let place = expert.last_place().scaled(1.0 / working, 1.0 / working);
            assert!(place.center_distance(&last) < 1.0, "{place:?} {last:?}");
        } else {
            unasked += 1;
            assert_eq!(answer, by_itself, "frame {t}");
        }
        last = answer.target;
    }
    assert!(unasked > 5 && is_asked, "{unasked}");
    assert!(looks() - at_first < 60 - unasked, "{}", looks());
    // A session with an expert that is asked only in doubt cannot go on with one that is always asked: the boxes would
    // differ.
    let bytes = both.snapshot();
    let always: Arc<dyn Expert> = expert.clone();
    let refused = Tracker::restore_beside(&bytes, Some(always)).unwrap_err();
    assert!(matches!(refused, TrackerError::Expert(_)), "{refused:?}");
    assert!(Tracker::restore_beside(&bytes, Some(in_doubt)).is_ok());
}

#[test]
fn a_session_goes_on_from_its_snapshot_with_the_same_expert_alone() {
    let says = |t: usize| Some((target(t), 0.8));
    let expert = Oracle::new(says);
    let mut both = tracker(&expert);
    for t in 1..8 {
        expert.at(t);
        both.step(&frame(t)).unwrap();
    }
    let bytes = both.snapshot();
    let shared: Arc<dyn Expert> = expert.clone();
    let mut restored = Tracker::restore_beside(&bytes, Some(shared.clone())).unwrap();
    assert!(restored.snapshot() == bytes);
    for t in 8..14 {
        expert.at(t);
        assert_eq!(
            restored.step(&frame(t)).unwrap(),
            both.step(&frame(t)).unwrap()
        );
        if t == 10 {
            both.retarget(&frame(11), target(11)).unwrap();
            restored.retarget(&frame(11), target(11)).unwrap();
        }
    }
    assert!(restored.snapshot() == both.snapshot());

    let refusal = |expert| Tracker::restore_beside(&bytes, expert).unwrap_err();
    let TrackerError::Expert(text) = refusal(None) else {
        panic!("another refusal");
    };
    assert!(text.contains("--model"), "{text}");
    let other: Arc<dyn Expert> = Arc::new(Oracle {
        says,
        asked: Mutex::default(),
        fingerprint: 8,
    });
    assert!(matches!(refusal(Some(other)), TrackerError::Expert(_)));
    // Damage is found as in any snapshot.
    for at in [20, bytes.len() / 2, bytes.len() - 1] {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1;
        let refused = Tracker::restore_beside(&damaged, Some(shared.clone())).unwrap_err();
        assert!(matches!(refused, TrackerError::Snapshot(_)), "{refused:?}");
    }
}

/// Snapshots with impossible values of the expert and a right checksum: whoever can change the bytes can change the
/// checksum, too.
#[test]
fn a_second_opinion_that_cannot_be_is_refused() {
    let expert = Oracle::new(|t| Some((target(t), 0.8)));
    let both = tracker(&expert);
    let shared: Arc<dyn Expert> = expert.clone();
    let alone = Tracker::new(&frame(0), target(0), robust(3))
        .unwrap()
        .snapshot();
    let bytes = both.snapshot();
    let mut refused = 0;
    for at in alone.len()..bytes.len() {
        for value in [0, 0x7f, 0xff] {
            let mut changed = bytes.clone();
            changed[at] = value;
            let crc = crc32fast::hash(&changed[16..]).to_le_bytes();
            changed[12..16].copy_from_slice(&crc);
            match Tracker::restore_beside(&changed, Some(shared.clone())) {
                Ok(mut tracker) => {
                    let answer = tracker.step(&frame(1)).unwrap();
                    assert!(answer.target.is_valid() && (0.0..=1.0).contains(&answer.score));
                }
                Err(_) => refused += 1,
            }
        }
    }
    assert!(refused > 20, "{refused}");
}

#[test]
fn a_session_without_an_expert_takes_none_from_its_snapshot_on() {
    let mut alone = Tracker::new(&frame(0), target(0), robust(3)).unwrap();
    let expert: Arc<dyn Expert> = Oracle::new(|_| Some((Rect::new(0.0, 0.0, 9.0, 9.0), 1.0)));
    let mut restored = Tracker::restore_beside(&alone.snapshot(), Some(expert.clone())).unwrap();
    assert_eq!(
        restored.step(&frame(1)).unwrap(),
        alone.step(&frame(1)).unwrap()
    );
    assert!(restored.snapshot() == alone.snapshot());
    // The score of the preset `paper` is no probability, so it cannot be weighed against the expert's.
    let paper = Tracker::beside(&frame(0), target(0), params(1), Some(expert)).unwrap_err();
    assert!(matches!(paper, TrackerError::Expert(_)), "{paper:?}");
}
