//! Frame numbers: which request holds the next frame, and which is an old one that was sent again.
//!
//! A client whose connection broke does not know whether its frame was taken. If it numbers its frames it can send the
//! request again: the same bytes under the same number get the stored answer. The answers to the last requests are kept,
//! so a request with several frames can be repeated too, and one after which others were answered.

use super::per_target::PerTarget;
use super::planted::PlantedFault;
use super::targets::{Correction, Estimates};
use bagtrack_tracker::{Estimate, Rect};
use serde::{Deserialize, Serialize};

/// The digest of an uploaded frame: XXH3-128 of its bytes as sent. It is not a cryptographic one: a client that forges
/// a collision gets a wrong stored answer for its own session only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint(u128);

impl Fingerprint {
    /// The digest of `bytes`.
    pub fn of(bytes: &[u8]) -> Self {
        Self(xxhash_rust::xxh3::xxh3_128(bytes))
    }
}

/// A frame that was answered.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Answered {
    /// Digest of the frame's bytes.
    pub(super) fingerprint: Fingerprint,
    /// What was answered for each target.
    pub(super) targets: PerTarget<TargetAnswer>,
}

/// What was answered for a target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct TargetAnswer {
    /// The box that the client gave with the frame: set for the first frame and for corrections.
    pub(super) given: Option<Rect>,
    pub(super) estimate: Estimate,
}

impl Answered {
    pub(super) fn estimates(&self) -> Estimates {
        self.targets.map(|target| target.estimate)
    }

    pub(super) fn frame(&self) -> u64 {
        self.targets.first().estimate.frame
    }

    /// Whether it answers these bytes, with this correction.
    fn is_of(&self, posted: Fingerprint, given: Option<Correction>) -> bool {
        let is_given = |correction: Correction| {
            let target = self.targets.as_slice().get(correction.target);
            target.is_some_and(|target| target.given == Some(correction.to))
        };
        self.fingerprint == posted && given.is_none_or(is_given)
    }
}

/// What to do with a request.
#[derive(Debug, Clone, PartialEq)]
pub enum ReplayDecision {
    /// It holds the next frame: process it.
    Process,
    /// It was answered before: these are the answers.
    Replay(Vec<Estimates>),
}

/// The frame number does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ReplayError {
    /// Neither the next frame nor the last one.
    #[error("frame {got} is out of order; the next frame is {expected}")]
    OutOfOrder {
        /// The number sent.
        got: u64,
        /// The number of the next frame.
        expected: u64,
    },
    /// The number of the last frame, with other bytes (or another box).
    #[error(
        "frame {got} was answered for other bytes or another box; the next frame is {expected}"
    )]
    Differs {
        /// The number sent.
        got: u64,
        /// The number of the next frame.
        expected: u64,
    },
}

/// Decides about a request with the frames `posted`, which the client numbers from `number` on. `recent` are the
/// answers to the last frames, at least one. `given` is the box, where the request corrects it.
///
/// A request is a replay if the answers to all its frames are stored, and their bytes (and the box) are the same.
///
/// # Errors
/// See [`ReplayError`].
pub(super) fn decide(
    recent: &[Answered],
    number: Option<u64>,
    posted: &[Fingerprint],
    given: Option<Correction>,
) -> Result<ReplayDecision, ReplayError> {
    let last = recent
        .last()
        .expect("a session has answered its first frame");
    let expected = last.frame() + 1;
    let got = match number {
        None => return Ok(ReplayDecision::Process),
        Some(number) if number == expected => return Ok(ReplayDecision::Process),
        Some(number) => number,
    };
    let first = recent.iter().position(|stored| stored.frame() == got);
    let stored = first.and_then(|first| recent[first..].get(..posted.len()));
    let stored = stored.ok_or(ReplayError::OutOfOrder { got, expected })?;
    let mut pairs = stored.iter().zip(posted);
    if pairs.all(|(stored, posted)| stored.is_of(*posted, given)) {
        if PlantedFault::TracksTwice.is_here() {
            return Ok(ReplayDecision::Process);
        }
        Ok(ReplayDecision::Replay(
            stored.iter().map(Answered::estimates).collect(),
        ))
    } else {
        Err(ReplayError::Differs { got, expected })
    }
}

/// The answer to frame `number` with this digest among those that are stored.
///
/// # Errors
/// See [`ReplayError`].
pub(super) fn stored(
    recent: &[Answered],
    number: u64,
    posted: Fingerprint,
) -> Result<&Answered, ReplayError> {
    let expected = recent.last().map_or(0, |last| last.frame() + 1);
    let got = number;
    match recent.iter().find(|stored| stored.frame() == number) {
        Some(stored) if stored.is_of(posted, None) => Ok(stored),
        Some(_) => Err(ReplayError::Differs { got, expected }),
        None => Err(ReplayError::OutOfOrder { got, expected }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bagtrack_tracker::Status;

    fn answered(frame: u64, bytes: &[u8]) -> Answered {
        let target = Rect {
            x: frame as f64,
            y: 0.0,
            width: 5.0,
            height: 5.0,
        };
        let estimate = Estimate {
            frame,
            target,
            score: 0.5,
            status: Status::Tracking,
        };
        Answered {
            fingerprint: Fingerprint::of(bytes),
            targets: PerTarget::One(TargetAnswer {
                given: None,
                estimate,
            }),
        }
    }

    fn prints(frames: &[&[u8]]) -> Vec<Fingerprint> {
        frames.iter().map(|bytes| Fingerprint::of(bytes)).collect()
    }

    #[test]
    fn the_next_frame_and_an_unnumbered_one_are_processed() {
        let recent = [answered(7, b"a")];
        for number in [None, Some(8)] {
            assert_eq!(
                decide(&recent, number, &prints(&[b"a"]), None),
                Ok(ReplayDecision::Process)
            );
        }
    }

    #[test]
    fn a_batch_or_a_part_of_it_is_replayed() {
        let recent = [answered(5, b"a"), answered(6, b"b"), answered(7, b"c")];
        let frames = |decision| -> Vec<u64> {
            match decision {
                Ok(ReplayDecision::Replay(answers)) => {
                    answers.iter().map(|answer| answer.first().frame).collect()
                }
                other => panic!("{other:?}"),
            }
        };
        let all = decide(&recent, Some(5), &prints(&[b"a", b"b", b"c"]), None);
        assert_eq!(frames(all), vec![5, 6, 7]);
        for (number, file) in [(7, b"c"), (6, b"b"), (5, b"a")] {
            let one = decide(&recent, Some(number), &prints(&[file]), None);
            assert_eq!(frames(one), vec![number]);
        }
        let begin = decide(&recent, Some(5), &prints(&[b"a", b"b"]), None);
        assert_eq!(frames(begin), vec![5, 6]);
    }

    #[test]
    fn other_bytes_differ_and_other_numbers_are_out_of_order() {
        let recent = [answered(6, b"b"), answered(7, b"c")];
        let differs = decide(&recent, Some(7), &prints(&[b"x"]), None);
        assert_eq!(
            differs,
            Err(ReplayError::Differs {
                got: 7,
                expected: 8
            })
        );
        for (number, posted) in [
            (5, prints(&[b"a"])),
            // The last of these is new.
            (7, prints(&[b"c", b"d"])),
            (9, prints(&[b"c"])),
            (u64::MAX, prints(&[b"c"])),
            (5, prints(&[b"a", b"b", b"c"])),
        ] {
            let decided = decide(&recent, Some(number), &posted, None);
            assert_eq!(
                decided,
                Err(ReplayError::OutOfOrder {
                    got: number,
                    expected: 8
                })
            );
        }
    }

    #[test]
    fn a_correction_is_replayed_only_with_the_same_box_of_the_same_target() {
        let mut corrected = answered(7, b"c");
        let [target] = corrected.targets.as_mut_slice() else {
            unreachable!("it has one target")
        };
        let to = target.estimate.target;
        target.given = Some(to);
        let recent = [corrected];
        let decided = |target, to| {
            let given = Some(Correction { target, to });
            decide(&recent, Some(7), &prints(&[b"c"]), given)
        };
        assert!(matches!(decided(0, to), Ok(ReplayDecision::Replay(_))));
        let differs = Err(ReplayError::Differs {
            got: 7,
            expected: 8,
        });
        assert_eq!(decided(0, Rect { x: 1.5, ..to }), differs);
        assert_eq!(decided(1, to), differs);
    }
}
