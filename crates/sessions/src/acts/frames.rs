//! The next frames of a session, as they were received: decode them, then track through them, or take the box that the
//! user gives.

use super::error::{FrameFault, FramesError};
use super::service::TrackingMetrics;
use crate::replay::{Answered, replayed};
use crate::streams::StreamPlace;
use crate::targets::TargetsError;
use crate::{Correction, Estimates, Fingerprint, SessionState, WorkMeter};
use bagtrack_ingest::{Inspected, Limits};
use bagtrack_tracker::{Diagnostics, Rect, TrackerError, check_box};
use bytes::Bytes;
use std::sync::Arc;

/// How many of its last answers a session keeps at least: for a client that goes on after its connection broke, and for
/// requests that are sent again because their answers were lost.
pub const KEPT_ANSWERS: usize = 32;

/// The next frames of a session, as they were received.
#[derive(Debug, Default)]
pub struct FrameBatch {
    /// The number of the first frame, where the client numbers its frames.
    pub number: Option<u64>,
    /// The image files of the frames, at least one.
    pub files: Vec<Bytes>,
    /// The corrected box of a target in the (first) frame, where the user gives one.
    pub correction: Option<GivenBox>,
    /// How many of the last answers are kept at least: [`KEPT_ANSWERS`], or more.
    pub min_answers: usize,
    /// Whether the client asks for [`Tracked::diagnostics`].
    pub with_diagnostics: bool,
    /// The stream that the frames came over; it has them in order. None is tracked after a newer stream has taken its
    /// place.
    pub stream: Option<Arc<StreamPlace>>,
}

/// The box of a target, given by the user.
#[derive(Debug, Clone, Copy)]
pub struct GivenBox {
    /// The target's index, from 0. It may be missing where the session has only one target.
    pub target: Option<usize>,
    /// The box.
    pub to: Rect,
}

impl GivenBox {
    /// Checks the box against a session with `count` targets and uploaded frames of `size` (width, height) pixels.
    fn of(self, count: usize, size: (u32, u32)) -> Result<Correction, FramesError> {
        check_box(&self.to, size)?;
        match self.target {
            None if count != 1 => Err(FramesError::NoSuchTarget { count }),
            Some(target) if target >= count => Err(FramesError::NoSuchTarget { count }),
            target => Ok(Correction {
                target: target.unwrap_or(0),
                to: self.to,
            }),
        }
    }
}

/// The answers to frames.
#[derive(Debug)]
pub struct Tracked {
    /// The answers, one for each frame, in the order of the frames.
    pub estimates: Vec<Estimates>,
    /// Whether these are the stored answers to a request that was sent again.
    pub replayed: bool,
    /// The diagnostics of each target's tracker for the last frame; empty unless asked for, and for a replay or a
    /// correction.
    pub diagnostics: Vec<Diagnostics>,
    /// The number of the last frame whose state is in the store; `None` without a store.
    pub checkpoint: Option<u64>,
}

/// What the frames of one request may cost.
#[derive(Debug, Clone, Copy)]
pub struct RequestLimits {
    /// The limits of each frame.
    pub frame: Limits,
    /// Most pixels of several frames together. A single frame has its own limit.
    pub max_pixels: u64,
}

impl FrameBatch {
    /// The frames of a plain request.
    pub fn posted(number: Option<u64>, files: Vec<Bytes>, correction: Option<GivenBox>) -> Self {
        Self {
            number,
            files,
            correction,
            min_answers: KEPT_ANSWERS,
            ..Self::default()
        }
    }

    /// Whether the order of the frames is unknown.
    pub(super) fn is_unordered(&self) -> bool {
        self.number.is_none() && self.stream.is_none()
    }

    /// Takes the frames into `state`: the stored answers if the request was answered before, else those of the tracker.
    /// The sizes of all frames are checked before the first is decoded; each is decoded in its turn, so that one of
    /// them is in memory. Between frames `meter` says whether to go on.
    ///
    /// # Errors
    /// A frame cannot be used, the frame number does not fit, the frames have too many pixels, or the work was stopped.
    /// `state` may then be half-way through the frames: drop it.
    pub(super) fn track(
        &self,
        state: &mut SessionState,
        limits: &RequestLimits,
        meter: &mut WorkMeter,
        metrics: &TrackingMetrics,
    ) -> Result<Tracked, FramesError> {
        let fingerprints = self.files.iter().map(|file| Fingerprint::of(file));
        let fingerprints: Vec<Fingerprint> = fingerprints.collect();
        let correction = self
            .correction
            .map(|given| given.of(state.target_count(), state.source_size()));
        let correction = correction.transpose()?;
        let replayed = replayed(&state.recent, self.number, &fingerprints, correction)?;
        if let Some(estimates) = replayed {
            return Ok(Tracked {
                estimates,
                replayed: true,
                diagnostics: Vec::new(),
                checkpoint: None,
            });
        }
        let inspected = self.inspect(limits, state.source_size())?;
        let format = state.frame_format();
        let before = state.latest();
        let mut diagnostics = Vec::new();
        let wanted = self.with_diagnostics && correction.is_none();
        let mut answered = Vec::with_capacity(inspected.len());
        for (index, (file, fingerprint)) in inspected.into_iter().zip(fingerprints).enumerate() {
            meter.check()?;
            let frame = metrics.decoding(|| file.decode(format));
            let frame = frame.map_err(|error| self.fault(index, error))?;
            let correction = correction.filter(|_| index == 0);
            let seen = wanted.then_some(&mut diagnostics);
            let step = state.step(frame, fingerprint, correction, meter, seen);
            answered.push(step.map_err(|error| match error {
                TargetsError::Refused(error) => self.fault(index, error),
                TargetsError::Stopped(stopped) => stopped.into(),
            })?);
        }
        let estimates: Vec<Estimates> = answered.iter().map(Answered::estimates).collect();
        state.store(answered, self.min_answers);
        metrics.tracked(&before, &estimates, &meter.take_steps());
        Ok(Tracked {
            estimates,
            replayed: false,
            diagnostics,
            checkpoint: None,
        })
    }

    /// Refuses a frame whose size is not the session's, and a request with too many pixels, by their headers alone.
    ///
    /// # Errors
    /// A frame has another size or is no image, or the frames have too many pixels together.
    pub fn check_sizes(&self, limits: &RequestLimits, size: (u32, u32)) -> Result<(), FramesError> {
        self.inspect(limits, size).map(drop)
    }

    /// As [`check_sizes`](Self::check_sizes); returns the frames with their parsed headers.
    fn inspect(
        &self,
        limits: &RequestLimits,
        (width, height): (u32, u32),
    ) -> Result<Vec<Inspected<'_>>, FramesError> {
        let mut inspected = Vec::with_capacity(self.files.len());
        for (index, file) in self.files.iter().enumerate() {
            let file = bagtrack_ingest::inspect(file, &limits.frame)
                .map_err(|error| self.fault(index, error))?;
            let (got_width, got_height) = file.size();
            if (got_width, got_height) != (width, height) {
                let error = TrackerError::FrameSize {
                    width,
                    height,
                    got_width,
                    got_height,
                };
                return Err(self.fault(index, error));
            }
            inspected.push(file);
        }
        limits.check_pixels(pixels(&inspected), self.files.len())?;
        Ok(inspected)
    }

    fn fault(&self, index: usize, fault: impl Into<FrameFault>) -> FramesError {
        fault_of(index, self.files.len(), fault)
    }
}

fn fault_of(index: usize, count: usize, fault: impl Into<FrameFault>) -> FramesError {
    FramesError::Frame {
        index,
        count,
        fault: fault.into(),
    }
}

impl RequestLimits {
    fn check_pixels(&self, pixels: u64, files: usize) -> Result<(), FramesError> {
        match files > 1 && pixels > self.max_pixels {
            true => Err(FramesError::TooManyPixels {
                pixels,
                limit: self.max_pixels,
            }),
            false => Ok(()),
        }
    }
}

/// Refuses a request whose frames have too many pixels together, by their headers alone.
///
/// # Errors
/// The frames have too many pixels together, or one of them is no image.
pub(super) fn check_pixels(files: &[Bytes], limits: &RequestLimits) -> Result<(), FramesError> {
    let inspected = files.iter().enumerate().map(|(index, file)| {
        bagtrack_ingest::inspect(file, &limits.frame)
            .map_err(|error| fault_of(index, files.len(), error))
    });
    let inspected: Vec<Inspected> = inspected.collect::<Result<_, _>>()?;
    limits.check_pixels(pixels(&inspected), files.len())
}

/// As `check_pixels`, for requests that answer each frame on its own: files that are no images count nothing here, and
/// are refused in their turn.
///
/// # Errors
/// The images have too many pixels together.
pub fn check_readable_pixels(files: &[Bytes], limits: &RequestLimits) -> Result<(), FramesError> {
    let inspected = files
        .iter()
        .filter_map(|file| bagtrack_ingest::inspect(file, &limits.frame).ok());
    let inspected: Vec<Inspected> = inspected.collect();
    limits.check_pixels(pixels(&inspected), files.len())
}

/// How many pixels the files have together.
fn pixels(inspected: &[Inspected]) -> u64 {
    let sizes = inspected.iter().map(Inspected::size);
    sizes
        .map(|(width, height)| u64::from(width) * u64::from(height))
        .sum()
}
