//! A session's next frames: decode them, then track through them or take the box that the user gives.

use super::problems::problem::Problem;
use crate::ingest::{self, Limits};
use crate::sessions::{Fingerprint, LockedSession, ReplayDecision};
use crate::tracker::{Estimate, Frame, FrameFormat, Rect, TrackerError};
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
        let format = locked.session().frame_format();
        let decoded = decode(&self.files, limits, &|_| format)?;
        self.check_sizes(&decoded, locked.session().source_size())?;
        let frames: Vec<_> = fingerprints.into_iter().zip(decoded).collect();
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
        frames
            .into_iter()
            .for_each(|(_, frame)| ingest::recycle(frame));
        let refused = |(index, error)| Problem::from(error).of_frame(index, self.files.len());
        Ok(Answered {
            estimates: estimates.map_err(refused)?,
            replayed: false,
        })
    }

    /// Refuses a frame whose size is not the session's.
    fn check_sizes(&self, frames: &[Frame], (width, height): (u32, u32)) -> Result<(), Problem> {
        let mut sizes = frames.iter().map(Frame::source_size);
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

/// Decodes all files of a request in the format that `format` says for uploads of a size.
///
/// # Errors
/// The problem of the first bad file.
pub fn decode(
    files: &[Bytes],
    limits: &Limits,
    format: &dyn Fn((u32, u32)) -> FrameFormat,
) -> Result<Vec<Frame>, Problem> {
    let decode_one = |(index, file): (usize, &Bytes)| {
        ingest::decode_to(file, limits, format)
            .map_err(|error| Problem::from(error).of_frame(index, files.len()))
    };
    files.iter().enumerate().map(decode_one).collect()
}
