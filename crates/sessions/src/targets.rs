//! The targets of a session: a tracker for each, which all see the same frames.
//!
//! A frame is decoded once, in the format that the smallest target asks for. The trackers of larger targets reduce the
//! frame to their own format. Each target has random numbers of its own; those of the first target are those of a
//! session with this target alone.

use super::scheduler::work_limit::{Stopped, WorkMeter};
use bagtrack_tracker::{
    Diagnostics, Estimate, Expert, Frame, FrameFormat, Params, Rect, Tracker, TrackerError,
};
use std::sync::Arc;

/// Most targets of a session.
pub const MAX_TARGETS: usize = 16;

/// A value for each target of a session.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum PerTarget<T> {
    /// The value of the only target of a session that was opened with a box.
    One(T),
    /// The values of the targets of a session that was opened with a list of boxes, in its order: 1 to [`MAX_TARGETS`].
    List(Vec<T>),
}

impl<T> PerTarget<T> {
    /// The value of the first target.
    pub fn first(&self) -> &T {
        &self.as_slice()[0]
    }

    /// The values of all targets, at least one.
    pub fn as_slice(&self) -> &[T] {
        match self {
            Self::One(one) => std::slice::from_ref(one),
            Self::List(list) => list,
        }
    }

    /// The values of all targets, to be changed.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        match self {
            Self::One(one) => std::slice::from_mut(one),
            Self::List(list) => list,
        }
    }

    /// Applies `change` to each target's number, counted from 0, and value.
    ///
    /// # Errors
    /// The first error of `change`.
    pub fn try_map<U, E>(
        &self,
        mut change: impl FnMut(usize, &T) -> Result<U, E>,
    ) -> Result<PerTarget<U>, E> {
        Ok(match self {
            Self::One(one) => PerTarget::One(change(0, one)?),
            Self::List(list) => {
                let changed = list.iter().enumerate();
                PerTarget::List(
                    changed
                        .map(|(k, it)| change(k, it))
                        .collect::<Result<_, E>>()?,
                )
            }
        })
    }

    /// Applies `change` to each value.
    pub fn map<U>(&self, change: impl Fn(&T) -> U) -> PerTarget<U> {
        match self {
            Self::One(one) => PerTarget::One(change(one)),
            Self::List(list) => PerTarget::List(list.iter().map(change).collect()),
        }
    }
}

/// Most bytes that the trackers of a list of targets keep together. Work on a frame needs as many again, for its copy.
pub const MAX_LIST_BYTES: usize = 8 << 20;

/// The answer to a frame: where each target is.
pub type Estimates = PerTarget<Estimate>;
/// The box of each target.
pub type Boxes = PerTarget<Rect>;

/// A box that the user gives for a target in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correction {
    /// Which target, counted from 0.
    pub target: usize,
    /// Its box, in pixels of the uploaded frame.
    pub to: Rect,
}

/// Why a frame was not taken.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum TargetsError {
    #[error(transparent)]
    Refused(TrackerError),
    #[error(transparent)]
    Stopped(Stopped),
}

/// Why no session begins.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StartError {
    /// The tracker of one of the targets, counted from 0, does not take its box, or a parameter.
    #[error("target {target}: {error}")]
    Refused {
        /// The target's number, counted from 0.
        target: usize,
        /// Why the tracker refused it.
        error: TrackerError,
    },
    /// With these parameters the targets together would keep more than [`MAX_LIST_BYTES`].
    #[error("{count} targets with these parameters keep more than {MAX_LIST_BYTES} bytes")]
    TooLarge {
        /// The number of targets.
        count: usize,
    },
    /// The work was stopped before all targets were started.
    #[error(transparent)]
    Stopped(Stopped),
}

/// The trackers of a session.
#[derive(Debug, Clone)]
pub(super) struct Targets(PerTarget<Tracker>);

/// The format in which frames are decoded for all of `boxes`, in uploads of the size `source` (width, height).
pub fn frame_format(params: &Params, source: (u32, u32), boxes: &Boxes) -> FrameFormat {
    let formats = boxes.as_slice().iter();
    largest_format(formats.map(|target| params.frame_format(source, target)))
}

/// The smallest format that none of `formats` exceeds in width, height or colour.
pub fn largest_format(formats: impl Iterator<Item = FrameFormat>) -> FrameFormat {
    let none = FrameFormat {
        size: (1, 1),
        has_color: false,
    };
    formats.fold(none, |most, format| FrameFormat {
        size: (
            most.size.0.max(format.size.0),
            most.size.1.max(format.size.1),
        ),
        has_color: most.has_color || format.has_color,
    })
}

impl Targets {
    /// A tracker for each box in `frame`, with `expert` beside it where there is one. `check` is called before each of
    /// them, and its error stops the work.
    ///
    /// # Errors
    /// See [`StartError`].
    pub(super) fn start(
        frame: &Frame,
        boxes: &Boxes,
        params: &Params,
        expert: Option<&Arc<dyn Expert>>,
        mut check: impl FnMut() -> Result<(), Stopped>,
    ) -> Result<Self, StartError> {
        let count = boxes.as_slice().len();
        if matches!(boxes, PerTarget::List(_)) && count * params.session_bytes() > MAX_LIST_BYTES {
            return Err(StartError::TooLarge { count });
        }
        let start = |target: usize, given: &Rect| {
            check().map_err(StartError::Stopped)?;
            Tracker::beside(frame, *given, params.of_target(target), expert.cloned())
                .map_err(|error| StartError::Refused { target, error })
        };
        boxes.try_map(start).map(Self)
    }

    /// These trackers, if all have frames of one size and together keep no more bytes than a session may.
    pub(super) fn restored(trackers: PerTarget<Tracker>) -> Option<Self> {
        let targets = Self(trackers);
        let all = targets.0.as_slice();
        let same = |tracker: &Tracker| tracker.source_size() == all[0].source_size();
        let fits = all.len() == 1 || targets.session_bytes() <= MAX_LIST_BYTES;
        (all.iter().all(same) && fits).then_some(targets)
    }

    pub(super) fn trackers(&self) -> &PerTarget<Tracker> {
        &self.0
    }

    pub(super) fn estimates(&self) -> Estimates {
        self.0.map(Tracker::estimate)
    }

    /// The format in which frames are decoded for all targets.
    pub(super) fn frame_format(&self) -> FrameFormat {
        largest_format(self.0.as_slice().iter().map(Tracker::frame_format))
    }

    /// Most bytes that the trackers keep.
    pub(super) fn session_bytes(&self) -> usize {
        let trackers = self.0.as_slice().iter();
        trackers
            .map(|tracker| tracker.params().session_bytes())
            .sum()
    }

    /// Tracks through a frame. `correction`, where given, sets the box of one target. Between targets `meter` may stop
    /// the work. Targets are tracked side by side where workers are idle. `seen` gets the diagnostics of each tracker
    /// but that of a corrected target.
    ///
    /// # Errors
    /// See [`TargetsError`]. With more than one target, some trackers may have taken the frame by then.
    pub(super) fn advance(
        &mut self,
        frame: &Arc<Frame>,
        correction: Option<Correction>,
        meter: &mut WorkMeter,
        seen: Option<&mut Vec<Diagnostics>>,
    ) -> Result<(), TargetsError> {
        if let Some(Correction { target, to }) = correction {
            let corrected = self.0.as_mut_slice()[target].retarget(frame, to);
            corrected.map_err(TargetsError::Refused)?;
        }
        let corrected = correction.map(|correction| correction.target);
        let wants_seen = seen.is_some();
        let all_saw = match &mut self.0 {
            PerTarget::One(_) if corrected.is_some() => Vec::new(),
            PerTarget::One(tracker) => {
                meter.check().map_err(TargetsError::Stopped)?;
                vec![meter.step(|| step(tracker, frame, wants_seen))]
            }
            PerTarget::List(trackers) => {
                let mut others = std::mem::take(trackers);
                let kept = corrected.map(|target| (target, others.remove(target)));
                let frame = frame.clone();
                let step = move |tracker: &mut Tracker| step(tracker, &frame, wants_seen);
                let outcome;
                (*trackers, outcome) = meter.side_by_side(others, step);
                if let Some((target, tracker)) = kept {
                    trackers.insert(target, tracker);
                }
                outcome.map_err(TargetsError::Stopped)?
            }
        };
        let all_saw = all_saw.into_iter().collect::<Result<Vec<_>, _>>();
        let all_saw = all_saw.map_err(TargetsError::Refused)?;
        if let Some(seen) = seen {
            *seen = all_saw.into_iter().flatten().collect();
        }
        Ok(())
    }
}

/// Tracks through a frame, and returns the tracker's diagnostics where they are wanted.
fn step(
    tracker: &mut Tracker,
    frame: &Frame,
    wants_seen: bool,
) -> Result<Option<Diagnostics>, TrackerError> {
    match wants_seen {
        true => tracker
            .step_with_diagnostics(frame)
            .map(|(_, seen)| Some(seen)),
        false => tracker.step(frame).map(|_| None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_format_has_the_longest_sides_and_colour_where_one_has() {
        let format = |size, has_color| FrameFormat { size, has_color };
        let largest = |formats: &[FrameFormat]| largest_format(formats.iter().copied());
        let (small, large) = (format((40, 30), true), format((80, 60), false));
        for formats in [[small, large], [large, small]] {
            assert_eq!(largest(&formats), format((80, 60), true));
        }
        assert_eq!(largest(&[large, large]), large);
        assert_eq!(largest(&[small]), small);
    }
}
