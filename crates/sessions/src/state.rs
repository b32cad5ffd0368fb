//! The part of a session that its frames change: the trackers, and the stored answers, which a repeated request gets
//! again.

use super::replay::{self, Answered, Fingerprint, ReplayError, TargetAnswer};
use super::scheduler::work_limit::{Stopped, WorkMeter};
use super::targets::{Boxes, Correction, Estimates, StartError, Targets, TargetsError};
use bagtrack_tracker::{BagEntry, Diagnostics, Expert, Frame, FrameFormat, Params};
use std::sync::Arc;

/// The part of a session that changes from frame to frame.
#[derive(Debug, Clone)]
pub struct SessionState {
    pub(super) targets: Targets,
    /// The stored answers to the last frames, oldest first, at least one; [`store`](Self::store) says how many.
    pub(super) recent: Vec<Answered>,
}

impl SessionState {
    /// A session that starts with `boxes` in `frame`, whose file has this digest, and with `expert` beside its trackers
    /// where there is one. `check` is called before each target, and its error stops the work.
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

    /// The format in which frames are decoded for all targets.
    pub fn frame_format(&self) -> FrameFormat {
        self.targets.frame_format()
    }

    /// Most bytes that the session keeps.
    pub fn session_bytes(&self) -> usize {
        self.targets.session_bytes()
    }

    /// The stored answers from frame `number` on, oldest first; `None` where one of them is not stored any more. From
    /// the next frame on the list is empty.
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
    /// The answer is no longer stored, or its frame had another digest.
    pub fn stored_answer(
        &self,
        number: u64,
        posted: Fingerprint,
    ) -> Result<Estimates, ReplayError> {
        replay::stored(&self.recent, number, posted).map(Answered::estimates)
    }

    /// Stores all new answers, and keeps the newest of the older ones, up to `kept` in all.
    pub(super) fn store(&mut self, answered: Vec<Answered>, kept: usize) {
        let older = kept.saturating_sub(answered.len()).min(self.recent.len());
        self.recent.drain(..self.recent.len() - older);
        self.recent.extend(answered);
    }

    /// Tracks through a frame with this digest. `correction`, where given, sets the box of one of the targets. Between
    /// targets `meter` may stop the work. The caller [stores](Self::store) the answer. `seen` gets the diagnostics of
    /// each tracker.
    ///
    /// # Errors
    /// The tracker refused the frame or the box, or the work was stopped. Some trackers may have taken the frame by
    /// then, so callers work on a copy.
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
        // If another worker still has a clone of the frame, its memory is not recycled.
        if let Some(frame) = Arc::into_inner(frame) {
            bagtrack_ingest::recycle(frame);
        }
        advanced.map(|()| self.answered(fingerprint, correction))
    }

    /// The answer to the last frame, which has this digest.
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
