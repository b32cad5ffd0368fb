//! What work on a session changes: the tracker, and the answers that a repeated request gets again.

use super::mac::MacKeys;
use super::replay::{self, Answered, Fingerprint, ReplayDecision, ReplayError};
use super::snapshot::{SessionSnapshot, SnapshotError};
use super::work_limit::{Stopped, WorkMeter};
use crate::tracker::{BagEntry, Estimate, Frame, Rect, Seen, Tracker, TrackerError};

/// The part of a session that changes from frame to frame.
#[derive(Debug)]
pub struct SessionState {
    tracker: Tracker,
    /// The last answers, oldest first: those to the last request, and more where that asked for it.
    recent: Vec<Answered>,
}

/// Why no frame of several was taken.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StepError {
    /// The tracker refused one of them.
    #[error("frame {index}: {error}")]
    Refused {
        /// Which one, counted from 0.
        index: usize,
        /// Why.
        error: TrackerError,
    },
    /// The work was stopped before all of them were taken.
    #[error(transparent)]
    Stopped(Stopped),
}

impl SessionState {
    /// A session that starts with `tracker`, which was made from the frame with this digest and from the box `given`.
    pub fn new(tracker: Tracker, fingerprint: Fingerprint, given: Rect) -> Self {
        let first = Answered {
            fingerprint,
            given: Some(given),
            estimate: tracker.estimate(),
        };
        Self {
            tracker,
            recent: vec![first],
        }
    }

    /// The session that a snapshot holds, with at most `max_recent` stored answers.
    ///
    /// # Errors
    /// See [`SnapshotError`].
    pub fn restore(
        snapshot: &[u8],
        keys: &MacKeys,
        max_recent: usize,
    ) -> Result<Self, SnapshotError> {
        let SessionSnapshot { tracker, recent } =
            SessionSnapshot::decode(snapshot, keys, max_recent)?;
        Ok(Self { tracker, recent })
    }

    /// The session as bytes, signed.
    pub fn snapshot(&self, keys: &MacKeys) -> Vec<u8> {
        SessionSnapshot::encode(&self.tracker, &self.recent, keys)
    }

    /// The bag, for people to look at.
    pub fn bag(&self) -> Vec<BagEntry> {
        self.tracker.bag()
    }

    /// The tracker.
    pub(super) fn tracker(&self) -> &Tracker {
        &self.tracker
    }

    /// Whether a request is to be processed or was answered before. `number` is what the client calls its (first)
    /// frame; `given` is the box, where it corrects one. Without a number every request is processed. With one, a
    /// request is a replay if its last frame is the session's last frame and all its frames are in the last request,
    /// with the same bytes and the same box.
    ///
    /// # Errors
    /// The frame number does not fit.
    pub fn replay_decision(
        &self,
        number: Option<u64>,
        posted: &[Fingerprint],
        given: Option<Rect>,
    ) -> Result<ReplayDecision, ReplayError> {
        replay::decide(&self.recent, number, posted, given)
    }

    /// The stored answers from frame `number` on, oldest first; none where one of them is not stored any more. All have
    /// been answered from the next frame on.
    pub fn answers_from(&self, number: u64) -> Option<Vec<Estimate>> {
        let next = self.tracker.estimate().frame + 1;
        let count = usize::try_from(next.checked_sub(number)?).ok()?;
        let first = self.recent.len().checked_sub(count)?;
        let stored = &self.recent[first..];
        Some(stored.iter().map(|answered| answered.estimate).collect())
    }

    /// Stores new answers, and of those before them as many as make `kept` together.
    fn store(&mut self, answered: Vec<Answered>, kept: usize) {
        let older = kept.saturating_sub(answered.len()).min(self.recent.len());
        self.recent.drain(..self.recent.len() - older);
        self.recent.extend(answered);
    }

    /// Tracks through `frames` in order: all of them, or none. Before each, `meter` says whether to go on. The answers
    /// are stored, and at least the last `kept`. `seen` becomes what the tracker saw in the last frame.
    ///
    /// # Errors
    /// The tracker refused a frame, or the work was stopped. The session is unchanged.
    pub fn step(
        &mut self,
        frames: &[(Fingerprint, Frame)],
        meter: &mut WorkMeter,
        kept: usize,
        mut seen: Option<&mut Seen>,
    ) -> Result<Vec<Estimate>, StepError> {
        // A refused frame leaves the tracker unchanged; only an earlier one of the same request can have moved it.
        let before = (frames.len() > 1).then(|| self.tracker.clone());
        let mut answered = Vec::with_capacity(frames.len());
        for (index, (fingerprint, frame)) in frames.iter().enumerate() {
            let going_on = meter.check().map_err(StepError::Stopped);
            let refused = |error| StepError::Refused { index, error };
            let mut step = || match seen.as_deref_mut() {
                Some(seen) => {
                    let (estimate, saw) = self.tracker.step_seeing(frame)?;
                    *seen = saw;
                    Ok(estimate)
                }
                None => self.tracker.step(frame),
            };
            match going_on.and_then(|()| step().map_err(refused)) {
                Ok(estimate) => answered.push(Answered {
                    fingerprint: *fingerprint,
                    given: None,
                    estimate,
                }),
                Err(error) => {
                    if let Some(before) = before {
                        self.tracker = before;
                    }
                    return Err(error);
                }
            }
        }
        let estimates = answered.iter().map(|answered| answered.estimate).collect();
        if !answered.is_empty() {
            self.store(answered, kept);
        }
        Ok(estimates)
    }

    /// Takes the next frame with its box given by the user. The answer is stored, and at least the last `kept`.
    ///
    /// # Errors
    /// The tracker refused the frame or the box. The session is unchanged.
    pub fn retarget(
        &mut self,
        fingerprint: Fingerprint,
        frame: &Frame,
        given: Rect,
        kept: usize,
    ) -> Result<Estimate, TrackerError> {
        let estimate = self.tracker.retarget(frame, given)?;
        let answered = Answered {
            fingerprint,
            given: Some(given),
            estimate,
        };
        self.store(vec![answered], kept);
        Ok(estimate)
    }
}
