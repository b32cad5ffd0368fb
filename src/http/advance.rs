//! A session's next frames: decode them, then track through them or take the box that the user gives.

use super::metrics::tracking::TrackingMetrics;
use super::problems::problem::Problem;
use crate::ingest::{self, Limits};
use crate::sessions::{Fingerprint, LockedSession, ReplayDecision};
use crate::tracker::{Estimate, GrayFrame, Rect, TrackerError};
use axum::body::Bytes;
use std::time::Instant;

/// The next frames of a session, as they were received.
#[derive(Debug)]
pub struct NextFrames {
    /// What the client calls the first of them, where it numbers them.
    pub number: Option<u64>,
    /// The files, at least one.
    pub files: Vec<Bytes>,
    /// The box in the only frame, where the user corrects it.
    pub correction: Option<Rect>,
}

/// The answers to a request.
#[derive(Debug)]
pub struct Answered {
    /// One for each frame, in the order of the frames.
    pub estimates: Vec<Estimate>,
    /// Whether they were given before.
    pub replayed: bool,
}

impl NextFrames {
    /// The answers: the stored ones if the request was answered before, else those of the tracker. All frames are
    /// decoded before the first is tracked.
    ///
    /// # Errors
    /// The problem of the first bad frame. The session is unchanged.
    pub fn advance(
        &self,
        locked: &mut LockedSession,
        limits: &Limits,
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
            return Ok(Answered {
                estimates,
                replayed: true,
            });
        }
        let decoded = decode(&self.files, limits, metrics)?;
        self.check_sizes(&decoded, locked.session().source_size())?;
        let frames: Vec<_> = fingerprints.into_iter().zip(decoded).collect();
        let (before, started) = (locked.session().latest(), Instant::now());
        let state = locked.state();
        let estimates = match self.correction {
            Some(target) => {
                let (fingerprint, frame) = &frames[0];
                let estimate = state.retarget(*fingerprint, frame, target);
                estimate
                    .map(|estimate| vec![estimate])
                    .map_err(|error| (0, error))
            }
            None => state.step(&frames),
        };
        let took = started.elapsed();
        frames
            .into_iter()
            .for_each(|(_, frame)| ingest::recycle(frame));
        let refused = |(index, error)| Problem::from(error).of_frame(index, self.files.len());
        let estimates = estimates.map_err(refused)?;
        metrics.tracked(before, &estimates, took);
        Ok(Answered {
            estimates,
            replayed: false,
        })
    }

    /// Refuses a frame whose size is not the session's.
    fn check_sizes(
        &self,
        frames: &[GrayFrame],
        (width, height): (u32, u32),
    ) -> Result<(), Problem> {
        let mut sizes = frames.iter().map(GrayFrame::source_size);
        let Some(index) = sizes.position(|size| size != (width, height)) else {
            return Ok(());
        };
        let (got_width, got_height) = frames[index].source_size();
        let error = TrackerError::FrameSize {
            width,
            height,
            got_width,
            got_height,
        };
        Err(Problem::from(error).of_frame(index, frames.len()))
    }
}

/// Decodes all files of a request.
///
/// # Errors
/// The problem of the first bad file.
pub fn decode(
    files: &[Bytes],
    limits: &Limits,
    metrics: &TrackingMetrics,
) -> Result<Vec<GrayFrame>, Problem> {
    let decode_one = |(index, file): (usize, &Bytes)| {
        metrics
            .decoding(|| ingest::decode(file, limits))
            .map_err(|error| Problem::from(error).of_frame(index, files.len()))
    };
    files.iter().enumerate().map(decode_one).collect()
}
