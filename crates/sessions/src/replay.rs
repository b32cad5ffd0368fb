//! Frame numbers: which request holds the next frame, and which is an old one that was sent again.
//!
//! A client whose connection broke does not know whether its frame was taken. If it numbers its frames it can send the
//! request again: the same bytes under the same number get the stored answer. The answers to the last frames are kept.
//! So a request with several frames can be repeated too, and so can an earlier one after later frames were answered.

use super::planted::PlantedFault;
use super::targets::{Correction, Estimates, PerTarget};
use bagtrack_tracker::{Estimate, Rect};
use serde::{Deserialize, Serialize};

/// The digest of an uploaded frame: XXH3-128 of its bytes as sent. This hash is not cryptographic: a client that forges
/// a collision gets a wrong stored answer, for its own session only.
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

    /// Whether this is the answer to these bytes, with this correction.
    fn is_of(&self, posted: Fingerprint, given: Option<Correction>) -> bool {
        let is_given = |correction: Correction| {
            let target = self.targets.as_slice().get(correction.target);
            target.is_some_and(|target| target.given == Some(correction.to))
        };
        self.fingerprint == posted && given.is_none_or(is_given)
    }
}

/// The frame number does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ReplayError {
    /// Neither the next frame nor one whose answer is stored.
    #[error("frame {got} is out of order; the next frame is {expected}")]
    OutOfOrder {
        /// The number sent.
        got: u64,
        /// The number of the next frame.
        expected: u64,
    },
    /// The number of a frame whose answer is stored, with other bytes (or another box).
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

/// The stored answers to a request with the frames `posted`, which the client numbers from `number` on; `None` where
/// the request begins with the next frame. `recent` are the answers to the last frames, at least one. `given` is the
/// request's correction of a box, if any.
///
/// A request is a replay if the answers to all its frames are stored, and their bytes (and the box) are the same. A
/// request without a number never is a replay.
///
/// # Errors
/// See [`ReplayError`].
pub(super) fn replayed(
    recent: &[Answered],
    number: Option<u64>,
    posted: &[Fingerprint],
    given: Option<Correction>,
) -> Result<Option<Vec<Estimates>>, ReplayError> {
    let last = recent
        .last()
        .expect("a session has answered its first frame");
    let expected = last.frame() + 1;
    let got = match number {
        None => return Ok(None),
        Some(number) if number == expected => return Ok(None),
        Some(number) => number,
    };
    let first = recent.iter().position(|stored| stored.frame() == got);
    let stored = first.and_then(|first| recent[first..].get(..posted.len()));
    let stored = stored.ok_or(ReplayError::OutOfOrder { got, expected })?;
    let mut pairs = stored.iter().zip(posted);
    if pairs.all(|(stored, posted)| stored.is_of(*posted, given)) {
        if PlantedFault::TracksTwice.is_here() {
            return Ok(None);
        }
        Ok(Some(stored.iter().map(Answered::estimates).collect()))
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
