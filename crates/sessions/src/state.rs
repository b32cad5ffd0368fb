//! What work on a session changes: the trackers, and the answers that a repeated request gets again.

use super::replay::{self, Answered, Fingerprint, ReplayError, TargetAnswer};
use super::scheduler::work_limit::{Stopped, WorkMeter};
use super::targets::{Boxes, Correction, Estimates, StartError, Targets, TargetsError};
use bagtrack_tracker::{BagEntry, Diagnostics, Expert, Frame, FrameFormat, Params};
use std::sync::Arc;

/// The part of a session that changes from frame to frame.
#[derive(Debug, Clone)]
pub struct SessionState {
    pub(super) targets: Targets,
    /// The answers to the last frames, oldest first, at least one: to those of the last request, and to so many before
    /// them as that request asked for.
    pub(super) recent: Vec<Answered>,
}

impl SessionState {
    /// A session that starts with `boxes` in `frame`, whose file has this digest, and with `expert` beside its trackers
    /// where there is one. Before each target `check` says whether to go on.
    ///
    /// # Errors
    /// See [`StartError`].
    pub fn start(
        frame: &Frame,
        fingerprint: Fingerprint,
        boxes: &Boxes,
        params: &Params,
        expert: Option<&Arc<dyn Expert>>,
        check: impl FnMut() -> Result<(), Stopped>,
    ) -> Result<Self, StartError> {
        let targets = Targets::start(frame, boxes, params, expert, check)?;
        let estimates = targets.estimates();
        let first = boxes.try_map(|target, given| {
            let estimate = estimates.as_slice()[target];
            let given = Some(*given);
            Ok(TargetAnswer { given, estimate })
        })?;
        let recent = vec![Answered {
            fingerprint,
            targets: first,
        }];
        Ok(Self { targets, recent })
    }

    /// The bag of a target, for people to look at; none if there is no such target.
    pub fn bag(&self, target: usize) -> Option<Vec<BagEntry>> {
        let tracker = self.targets.trackers().as_slice().get(target)?;
        Some(tracker.bag())
    }

    /// The last answer.
    pub fn latest(&self) -> Estimates {
        self.targets.estimates()
    }

    /// The number of the last frame.
    pub fn latest_frame(&self) -> u64 {
        self.targets.trackers().first().estimate().frame
    }

    /// How many targets there are.
    pub fn target_count(&self) -> usize {
        self.targets.trackers().as_slice().len()
    }

    /// Width and height of the frames as uploaded.
    pub fn source_size(&self) -> (u32, u32) {
        self.targets.trackers().first().source_size()
    }

    /// The parameters, with the seed of the first target.
    pub fn params(&self) -> &Params {
        self.targets.trackers().first().params()
    }

    /// How frames are decoded.
    pub fn frame_format(&self) -> FrameFormat {
        self.targets.frame_format()
    }

    /// Bytes that the session keeps at most.
    pub fn session_bytes(&self) -> usize {
        self.targets.session_bytes()
    }

    /// The stored answers from frame `number` on, oldest first; none where one of them is not stored any more. All have
    /// been answered from the next frame on.
    pub fn answers_from(&self, number: u64) -> Option<Vec<Estimates>> {
        let next = self.latest_frame() + 1;
        let count = usize::try_from(next.checked_sub(number)?).ok()?;
        let first = self.recent.len().checked_sub(count)?;
        let stored = &self.recent[first..];
        Some(stored.iter().map(Answered::estimates).collect())
    }

    /// The stored answer to frame `number`, which has this digest and was answered.
    ///
    /// # Errors
    /// It is no longer stored, or was the answer to another frame.
    pub fn stored_answer(
        &self,
        number: u64,
        posted: Fingerprint,
    ) -> Result<Estimates, ReplayError> {
        replay::stored(&self.recent, number, posted).map(Answered::estimates)
    }

    /// Stores new answers, and of those before them as many as make `kept` together.
    pub(super) fn store(&mut self, answered: Vec<Answered>, kept: usize) {
        let older = kept.saturating_sub(answered.len()).min(self.recent.len());
        self.recent.drain(..self.recent.len() - older);
        self.recent.extend(answered);
    }

    /// Tracks through a frame with this digest, in which the user may correct a target, which there must be. Between
    /// targets `meter` says whether to go on. The answer is to be [stored](Self::store). `seen` becomes what the
    /// trackers saw.
    ///
    /// # Errors
    /// The tracker refused the frame or the box, or the work was stopped. Some targets may have taken the frame then,
    /// so callers work on a copy.
    pub(super) fn step(
        &mut self,
        frame: Frame,
        fingerprint: Fingerprint,
        correction: Option<Correction>,
        meter: &mut WorkMeter,
        seen: Option<&mut Vec<Diagnostics>>,
    ) -> Result<Answered, TargetsError> {
        let frame = Arc::new(frame);
        let advanced = self.targets.advance(&frame, correction, meter, seen);
        // Where another worker is still about to let go of it, its memory is not used again.
        if let Some(frame) = Arc::into_inner(frame) {
            bagtrack_ingest::recycle(frame);
        }
        advanced.map(|()| self.answered(fingerprint, correction))
    }

    /// The answer to the frame with this digest, which was the last.
    fn answered(&self, fingerprint: Fingerprint, correction: Option<Correction>) -> Answered {
        let mut targets = self.latest().map(|estimate| TargetAnswer {
            given: None,
            estimate: *estimate,
        });
        if let Some(Correction { target, to }) = correction {
            targets.as_mut_slice()[target].given = Some(to);
        }
        Answered {
            fingerprint,
            targets,
        }
    }
}
