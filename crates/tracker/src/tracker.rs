//! The tracker of one session, as the rest of the program sees it.

use std::borrow::Cow;
use std::sync::Arc;

use crate::bag_view::BagEntry;
use crate::candidates::Candidates;
use crate::confidence::score::Evidence;
use crate::diagnostics::Diagnostics;
use crate::error::TrackerError;
use crate::estimate::Estimate;
use crate::expert::opinion::Expert;
use crate::image::frame::{Frame, FrameFormat};
use crate::image::rect::Rect;
use crate::input;
use crate::params::table::Params;
use crate::snapshot;
use crate::state::State;
use crate::workspace;

const NO_PROBABILITY: &str = "a second opinion goes with the preset robust: without a discriminant there is no score \
    that it could be weighed by";

/// Follows one object.
///
/// An error of any method leaves the tracker as it was.
#[derive(Debug, Clone)]
pub struct Tracker {
    state: State,
    evidence: Option<Evidence>,
    /// None where the state has no second opinion.
    expert: Option<Arc<dyn Expert>>,
}

impl Tracker {
    /// Starts on `frame` with the box `target`, in the pixels of the uploaded frame. The box may reach over the edge.
    ///
    /// # Errors
    /// A parameter out of its range; a frame that was reduced to less than [`Params::frame_format`]; a box that is not
    /// finite, has a side below [`MIN_BOX_SIDE`](crate::MIN_BOX_SIDE) pixels (or below one pixel of the
    /// working image) or above four times the frame's longer side, or lies outside the frame.
    pub fn new(frame: &Frame, target: Rect, params: Params) -> Result<Self, TrackerError> {
        Self::beside(frame, target, params, None)
    }

    /// As [`new`](Self::new), with an expert beside the filter. Without an expert this is `new`.
    ///
    /// # Errors
    /// As for [`new`](Self::new); also an expert with parameters that take none ([`Params::takes_expert`]), as those of
    /// [`Preset::Paper`](crate::Preset::Paper).
    pub fn beside(
        frame: &Frame,
        target: Rect,
        params: Params,
        expert: Option<Arc<dyn Expert>>,
    ) -> Result<Self, TrackerError> {
        params.validate()?;
        if expert.is_some() && !params.takes_expert() {
            return Err(TrackerError::Expert(NO_PROBABILITY));
        }
        let source = frame.source_size();
        let mut format = params.frame_format(source, &target);
        input::check_target(source, format.size, &target)?;
        format.has_color &= frame.has_color();
        let frame = frame.in_format(format).ok_or(TrackerError::Reduced)?;
        Ok(workspace::with(|workspace| {
            let state = State::new(&frame, format, target, params, expert.as_deref(), workspace);
            Self {
                state,
                evidence: None,
                expert,
            }
        }))
    }

    /// Finds the target in the next frame.
    ///
    /// # Errors
    /// A frame whose uploaded size is not that of the session's first frame, or that was reduced to less than
    /// [`frame_format`](Self::frame_format).
    pub fn step(&mut self, frame: &Frame) -> Result<Estimate, TrackerError> {
        Ok(self.advance(frame, |_, _| ())?.0)
    }

    /// Like [`step`](Self::step), with the particles and votes that the answer was chosen from.
    ///
    /// # Errors
    /// As for [`step`](Self::step).
    pub fn step_with_diagnostics(
        &mut self,
        frame: &Frame,
    ) -> Result<(Estimate, Diagnostics), TrackerError> {
        self.advance(frame, Diagnostics::of)
    }

    /// Steps, and has a look at the candidates of the step.
    fn advance<T>(
        &mut self,
        frame: &Frame,
        look: impl FnOnce(&State, &Candidates) -> T,
    ) -> Result<(Estimate, T), TrackerError> {
        let frame = self.checked(frame)?;
        workspace::with(|workspace| {
            let expert = self.expert.as_deref();
            let (estimate, evidence) = self.state.step(&frame, expert, workspace);
            self.evidence = Some(evidence);
            Ok((estimate, look(&self.state, &workspace.scratch.candidates)))
        })
    }

    /// The user corrects the box: `frame` counts as the next frame, with the answer given.
    /// The bag keeps its entries and gains one for the new box; history and particles restart at the box.
    ///
    /// # Errors
    /// A frame as in [`step`](Self::step), a box as in [`new`](Self::new).
    pub fn retarget(&mut self, frame: &Frame, target: Rect) -> Result<Estimate, TrackerError> {
        let frame = self.checked(frame)?;
        input::check_target(self.state.source, self.state.format.size, &target)?;
        let expert = self.expert.as_deref();
        workspace::with(|workspace| self.state.retarget(&frame, target, expert, workspace));
        self.evidence = None;
        Ok(self.state.estimate)
    }

    /// `frame` as this session sees frames.
    fn checked<'a>(&self, frame: &'a Frame) -> Result<Cow<'a, Frame>, TrackerError> {
        input::check_frame(self.state.source, frame)?;
        frame
            .in_format(self.state.format)
            .ok_or(TrackerError::Reduced)
    }

    /// How this session sees its frames. A frame in this format is not copied.
    pub fn frame_format(&self) -> FrameFormat {
        self.state.format
    }

    /// The last answer.
    pub fn estimate(&self) -> Estimate {
        self.state.estimate
    }

    /// What the score of the last answer is made of, where that was given by [`step`](Self::step). None after
    /// [`new`](Self::new), [`retarget`](Self::retarget) and [`restore`](Self::restore).
    pub fn evidence(&self) -> Option<Evidence> {
        self.evidence
    }

    /// The particles of the last frame, in the order in which they were drawn: the box of each, in the pixels of the
    /// uploaded frame, and its weight. Weights are at least 0 and sum to 1; the next particles are drawn by them.
    ///
    /// After [`new`](Self::new) and [`retarget`](Self::retarget) all are at the box given, with equal weights. There
    /// are none with [`Search::Answer`](crate::Search::Answer): then the next particles are drawn around the
    /// answer, and the last ones are not kept.
    pub fn particles(&self) -> impl ExactSizeIterator<Item = (Rect, f64)> {
        let state = &self.state;
        let cloud = state.cloud.as_ref();
        let particles = cloud.map_or(&[][..], |cloud| &cloud.particles);
        let weights = cloud.map_or(&[][..], |cloud| &cloud.weights);
        let boxes = particles.iter().map(|it| state.target_of(it));
        boxes.zip(weights.iter().copied())
    }

    /// The entries of the bag, oldest first, for people to look at.
    pub fn bag(&self) -> Vec<BagEntry> {
        let State {
            appearance, params, ..
        } = &self.state;
        let entries = appearance.model().subspaces(params);
        let view = |entry| BagEntry::of(entry, params);
        entries.iter().map(view).collect()
    }

    /// The parameters of this tracker.
    pub fn params(&self) -> &Params {
        &self.state.params
    }

    /// Width and height of the session's frames, before downscaling.
    pub fn source_size(&self) -> (u32, u32) {
        self.state.source
    }

    /// The whole state as bytes, versioned.
    pub fn snapshot(&self) -> Vec<u8> {
        snapshot::write(&self.state)
    }

    /// A tracker that goes on from `snapshot`, bit for bit.
    ///
    /// # Errors
    /// Bytes that are not a snapshot of this version, are damaged, or hold a state that no tracker can be in.
    pub fn restore(snapshot: &[u8]) -> Result<Self, TrackerError> {
        Self::restore_beside(snapshot, None)
    }

    /// As [`restore`](Self::restore), with the expert that the session may have begun with. A session that began
    /// without one goes on without.
    ///
    /// # Errors
    /// As for [`restore`](Self::restore); also a session that began with another expert, or with one where none is
    /// given.
    pub fn restore_beside(
        snapshot: &[u8],
        expert: Option<Arc<dyn Expert>>,
    ) -> Result<Self, TrackerError> {
        Self::restored(snapshot, expert, None)
    }

    /// As [`restore_beside`](Self::restore_beside), where `self` is at an earlier or later state of the same session.
    /// What both states have in common is not computed again, which saves most of the time. The restored tracker is the
    /// same, bit for bit.
    ///
    /// # Errors
    /// As for [`restore_beside`](Self::restore_beside).
    pub fn restore_near(
        &self,
        snapshot: &[u8],
        expert: Option<Arc<dyn Expert>>,
    ) -> Result<Self, TrackerError> {
        Self::restored(snapshot, expert, Some(&self.state))
    }

    fn restored(
        snapshot: &[u8],
        expert: Option<Arc<dyn Expert>>,
        known: Option<&State>,
    ) -> Result<Self, TrackerError> {
        let state = snapshot::read(snapshot, expert.as_deref(), known)?;
        let expert = expert.filter(|_| state.second_opinion.is_some());
        Ok(Self {
            state,
            evidence: None,
            expert,
        })
    }
}
