//! A session's next frames: decode them, then track through them or take the box that the user gives.

use crate::http::metrics::tracking::TrackingMetrics;
use crate::http::problems::problem::Problem;
use crate::http::respond::target_box::TargetBox;
use crate::http::stream::open_streams::StreamPlace;
use crate::ingest::{self, Limits};
use crate::sessions::{
    ByteCharge, Correction, Estimates, Fingerprint, LockedSession, ReplayDecision, Session,
    SessionState, StepError, WorkMeter,
};
use crate::tracker::{Frame, FrameFormat, Seen, TrackerError};
use axum::body::Bytes;
use std::sync::Arc;

/// The next frames of a session, as they were received.
#[derive(Debug)]
pub struct NextFrames {
    /// What the client calls the first of them, where it numbers them.
    pub number: Option<u64>,
    /// The files, at least one.
    pub files: Vec<Bytes>,
    /// The box in the only frame, where the user corrects it.
    pub correction: Option<GivenBox>,
    /// How many of the last answers are kept at least, for a client that takes up where its line broke.
    pub kept: usize,
    /// Whether the client wants to know what the trackers saw.
    pub sees: bool,
    /// The stream that they came over. It tells their order, and tracks none after a newer one has taken its place.
    pub stream: Option<Arc<StreamPlace>>,
    /// The memory of the files, where the place in the queue does not hold it.
    pub _charge: Option<Arc<ByteCharge>>,
}

/// The box of a target, given by the user.
#[derive(Debug, Clone, Copy)]
pub struct GivenBox {
    /// Which target, counted from 0, where the user says it.
    pub target: Option<usize>,
    /// The box.
    pub to: TargetBox,
}

impl GivenBox {
    /// The correction in a session with so many targets.
    ///
    /// # Errors
    /// There is no such target, or it is not told which of several is meant.
    fn of(self, count: usize) -> Result<Correction, Problem> {
        let target = match self.target {
            Some(target) => target,
            None if count == 1 => 0,
            None => return Err(Problem::which_target(count)),
        };
        match target < count {
            true => Ok(Correction {
                target,
                to: self.to.into(),
            }),
            false => Err(Problem::which_target(count)),
        }
    }
}

/// The answers to a request.
#[derive(Debug)]
pub struct Answered {
    /// One for each frame, in the order of the frames.
    pub estimates: Vec<Estimates>,
    /// Whether they were given before.
    pub replayed: bool,
    /// What the tracker of each target saw in the last frame, where that was asked for and the frame was tracked now.
    pub seen: Vec<Seen>,
    /// The last frame whose state is in the store, where there is one.
    pub checkpoint: Option<u64>,
}

impl NextFrames {
    /// The frames of a plain request.
    pub fn posted(number: Option<u64>, files: Vec<Bytes>, correction: Option<GivenBox>) -> Self {
        Self {
            number,
            files,
            correction,
            kept: 0,
            sees: false,
            stream: None,
            _charge: None,
        }
    }

    /// Refuses frames of a stream whose place a newer one has taken.
    ///
    /// # Errors
    /// It has. The newer one has told its client which frame is the next.
    pub fn check_stream(&self, session: &Session) -> Result<(), Problem> {
        let stream = self.stream.as_ref();
        match stream.is_some_and(|place| place.has_ended(session)) {
            true => Err(Problem::work_timeout()),
            false => Ok(()),
        }
    }

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
        self.check_stream(locked.session())?;
        let answered = self.advance_state(locked.state(), limits, meter, metrics)?;
        locked.session().renew();
        Ok(answered)
    }

    /// The same with a state that need not be a session's.
    ///
    /// # Errors
    /// See [`Self::advance`]. The state is unchanged.
    pub fn advance_state(
        &self,
        state: &mut SessionState,
        limits: &RequestLimits,
        meter: &mut WorkMeter,
        metrics: &TrackingMetrics,
    ) -> Result<Answered, Problem> {
        let fingerprints: Vec<Fingerprint> = self
            .files
            .iter()
            .map(|file| Fingerprint::of(file))
            .collect();
        let correction = self.correction.map(|given| given.of(state.target_count()));
        let correction = correction.transpose()?;
        let decision = state.replay_decision(self.number, &fingerprints, correction)?;
        if let ReplayDecision::Replay(estimates) = decision {
            return Ok(Answered {
                estimates,
                replayed: true,
                seen: Vec::new(),
                checkpoint: None,
            });
        }
        self.check_sizes(limits, state.source_size())?;
        let format = state.frame_format();
        let decoded = decode(&self.files, &limits.frame, &|_| format, meter, metrics)?;
        let frames: Vec<_> = fingerprints.into_iter().zip(decoded).collect();
        let before = state.latest();
        let mut seen = Vec::new();
        let sees = (self.sees && correction.is_none()).then_some(&mut seen);
        let estimates = state.advance(&frames, correction, meter, self.kept, sees);
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
        metrics.tracked(&before, &estimates, &meter.take_steps());
        Ok(Answered {
            estimates,
            replayed: false,
            seen,
            checkpoint: None,
        })
    }

    /// Refuses a frame whose size is not the session's, and a request with too many pixels, by their headers alone.
    ///
    /// # Errors
    /// It is one of these, or no image.
    pub fn check_sizes(
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
        limits.check_pixels(pixels, self.files.len())
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

impl RequestLimits {
    fn check_pixels(&self, pixels: u64, files: usize) -> Result<(), Problem> {
        match files > 1 && pixels > self.max_pixels {
            true => Err(Problem::too_many_pixels(pixels, self.max_pixels)),
            false => Ok(()),
        }
    }
}

/// Refuses a request whose frames have too many pixels together, by their headers alone.
///
/// # Errors
/// They have, or one of them is no image.
pub fn check_pixels(files: &[Bytes], limits: &RequestLimits) -> Result<(), Problem> {
    let mut pixels = 0;
    for (index, file) in files.iter().enumerate() {
        let size = ingest::size(file, &limits.frame);
        let (width, height) =
            size.map_err(|error| Problem::from(error).of_frame(index, files.len()))?;
        pixels += u64::from(width) * u64::from(height);
    }
    limits.check_pixels(pixels, files.len())
}

/// The same where each frame is answered for itself: one that is no image is refused in its turn.
///
/// # Errors
/// Those that are images have too many pixels.
pub fn check_readable_pixels(files: &[Bytes], limits: &RequestLimits) -> Result<(), Problem> {
    let sizes = files
        .iter()
        .filter_map(|file| ingest::size(file, &limits.frame).ok());
    let pixels = sizes.map(|(width, height)| u64::from(width) * u64::from(height));
    limits.check_pixels(pixels.sum(), files.len())
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
