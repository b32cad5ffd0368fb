//! A session's next frames: decode them, then track through them or take the box that the user gives.

use super::metrics::tracking::TrackingMetrics;
use super::problems::problem::Problem;
use crate::ingest::{self, Limits};
use crate::sessions::{Fingerprint, LockedSession, ReplayDecision, StepError, WorkMeter};
use crate::tracker::{Estimate, Frame, FrameFormat, Rect, Seen, TrackerError};
use axum::body::Bytes;

/// The next frames of a session, as they were received.
#[derive(Debug)]
pub struct NextFrames {
    /// What the client calls the first of them, where it numbers them.
    pub number: Option<u64>,
    /// The files, at least one.
    pub files: Vec<Bytes>,
    /// The box in the only frame, where the user corrects it.
    pub correction: Option<Rect>,
    /// How many of the last answers are kept at least, for a client that takes up where its line broke.
    pub kept: usize,
    /// Whether the client wants to know what the tracker saw.
    pub sees: bool,
}

/// The answers to a request.
#[derive(Debug)]
pub struct Answered {
    /// One for each frame, in the order of the frames.
    pub estimates: Vec<Estimate>,
    /// Whether they were given before.
    pub replayed: bool,
    /// What the tracker saw in the last frame, where that was asked for and the frame was tracked now.
    pub seen: Option<Seen>,
}

impl NextFrames {
    /// The answers: the stored ones if the request was answered before, else those of the tracker. The sizes of all
    /// frames are checked before the first is decoded, and all are decoded before the first is tracked. Between frames
    /// `meter` says whether to go on.
    ///
    /// # Errors
    /// The problem of the first bad frame, or of a request that costs too much. The session is unchanged.
    pub fn advance(
        &self,
        locked: &mut LockedSession,
        limits: &RequestLimits,
        meter: &mut WorkMeter,
        metrics: &TrackingMetrics,
    ) -> Result<Answered, Problem> {
        let fingerprints: Vec<Fingerprint> = self
            .files
            .iter()
            .map(|file| Fingerprint::of(file))
            .collect();
        let decision =
            locked
                .state()
                .replay_decision(self.number, &fingerprints, self.correction)?;
        if let ReplayDecision::Replay(estimates) = decision {
            locked.session().renew();
            return Ok(Answered {
                estimates,
                replayed: true,
                seen: None,
            });
        }
        self.check_sizes(limits, locked.session().source_size())?;
        let format = locked.session().frame_format();
        let decoded = decode(&self.files, &limits.frame, &|_| format, meter, metrics)?;
        let frames: Vec<_> = fingerprints.into_iter().zip(decoded).collect();
        let (before, started) = (locked.session().latest(), meter.cpu_time());
        let state = locked.state();
        let mut seen = (self.sees && self.correction.is_none()).then(Seen::default);
        let estimates = match self.correction {
            Some(target) => {
                let (fingerprint, frame) = &frames[0];
                let estimate = state.retarget(*fingerprint, frame, target, self.kept);
                estimate
                    .map(|estimate| vec![estimate])
                    .map_err(|error| StepError::Refused { index: 0, error })
            }
            None => state.step(&frames, meter, self.kept, seen.as_mut()),
        };
        let took = meter.cpu_time().saturating_sub(started);
        frames
            .into_iter()
            .for_each(|(_, frame)| ingest::recycle(frame));
        let refused = |error| match error {
            StepError::Refused { index, error } => {
                Problem::from(error).of_frame(index, self.files.len())
            }
            StepError::Stopped(stopped) => stopped.into(),
        };
        let estimates = estimates.map_err(refused)?;
        locked.session().renew();
        metrics.tracked(before, &estimates, took);
        Ok(Answered {
            estimates,
            replayed: false,
            seen,
        })
    }

    /// Refuses a frame whose size is not the session's, and a request with too many pixels, by their headers alone.
    fn check_sizes(
        &self,
        limits: &RequestLimits,
        (width, height): (u32, u32),
    ) -> Result<(), Problem> {
        let mut pixels = 0;
        for (index, file) in self.files.iter().enumerate() {
            let of_frame = |problem: Problem| problem.of_frame(index, self.files.len());
            let size = ingest::size(file, &limits.frame);
            let (got_width, got_height) = size.map_err(|error| of_frame(error.into()))?;
            if (got_width, got_height) != (width, height) {
                let error = TrackerError::FrameSize {
                    width,
                    height,
                    got_width,
                    got_height,
                };
                return Err(of_frame(error.into()));
            }
            pixels += u64::from(width) * u64::from(height);
        }
        if self.files.len() > 1 && pixels > limits.max_pixels {
            return Err(Problem::too_many_pixels(pixels, limits.max_pixels));
        }
        Ok(())
    }
}

/// What the frames of one request may cost.
#[derive(Debug, Clone, Copy)]
pub struct RequestLimits {
    /// The limits of each frame.
    pub frame: Limits,
    /// Most pixels of several frames together. A single frame has its own limit.
    pub max_pixels: u64,
}

/// Decodes all files of a request in the format that `format` says for uploads of a size. Between them `meter` says
/// whether to go on.
///
/// # Errors
/// The problem of the first bad file, or that the work was stopped.
pub fn decode(
    files: &[Bytes],
    limits: &Limits,
    format: &dyn Fn((u32, u32)) -> FrameFormat,
    meter: &mut WorkMeter,
    metrics: &TrackingMetrics,
) -> Result<Vec<Frame>, Problem> {
    let decode_one = |(index, file): (usize, &Bytes)| {
        meter.check()?;
        metrics
            .decoding(|| ingest::decode_to(file, limits, format))
            .map_err(|error| Problem::from(error).of_frame(index, files.len()))
    };
    files.iter().enumerate().map(decode_one).collect()
}
