//! Tracking the targets of one request, one after the other.

use super::message::{CvatAnswer, Target, Targets};
use crate::http::problems::problem::Problem;
use crate::http::respond::json;
use crate::http::service::advance::{NextFrames, decode};
use crate::http::service::state::AppState;
use crate::ingest;
use crate::sessions::{
    ByteCharge, Fingerprint, PerTarget, SessionState, SnapshotError, StepError, WorkMeter,
    frame_format, largest_format,
};
use crate::tracker::{Frame, Params, Status};
use std::slice;
use std::sync::Arc;

/// Most bytes of a shape in an answer.
const SHAPE_BYTES: usize = 128;

/// The body of the answer. A state is held only while its own target is at work: together they may be large. `charge`
/// grows with the answer, before that does.
///
/// # Errors
/// The problem of the first target that cannot be tracked, or of the frame.
pub fn track(
    state: &AppState,
    request: &Targets,
    params: &Params,
    meter: &mut WorkMeter,
    charge: &mut ByteCharge,
) -> Result<Vec<u8>, Problem> {
    let worker = Worker { state, params };
    let (file, count) = (slice::from_ref(&request.file), request.targets.len());
    let limits = state.config.request_limits();
    let mut formats = Vec::new();
    let mut boxes = Vec::new();
    for (index, target) in request.targets.iter().enumerate() {
        match target {
            Target::New(rect) => boxes.push(*rect),
            Target::Known(snapshot) => {
                meter.check()?;
                let track = worker.restore(snapshot);
                let track = track.map_err(|error| Problem::from(error).of_target(index, count))?;
                let frames = NextFrames::posted(None, file.to_vec(), None);
                frames.check_sizes(&limits, track.source_size())?;
                formats.push(track.frame_format());
            }
        }
    }
    let format = |source| {
        let new = (!boxes.is_empty())
            .then(|| frame_format(params, source, &PerTarget::List(boxes.clone())));
        largest_format(formats.iter().copied().chain(new))
    };
    let metrics = &state.metrics.tracking;
    let mut decoded = decode(file, &limits.frame, &format, meter, metrics)?;
    let frames = [(Fingerprint::of(&request.file), decoded.remove(0))];
    let mut answer = CvatAnswer::default();
    for (index, target) in request.targets.iter().enumerate() {
        let track = worker.step(target, &frames, meter);
        let track = track.map_err(|problem| problem.of_target(index, count))?;
        let estimate = *track.latest().first();
        let found = (estimate.status != Status::Lost).then_some(estimate.target);
        let snapshot = track.snapshot(&state.access.snapshots);
        charge.grow(answered_bytes(&snapshot))?;
        answer.push(found, &snapshot);
    }
    let [(_, frame)] = frames;
    ingest::recycle(frame);
    let body = json::line(&answer).map_err(|error| Problem::internal(Arc::new(error)))?;
    charge.shrink(body.len());
    Ok(body)
}

/// Bytes that a target takes in an answer: its state as base64, and the same in the body.
fn answered_bytes(snapshot: &[u8]) -> usize {
    2 * (SHAPE_BYTES + snapshot.len().div_ceil(3) * 4)
}

/// What all targets of a request have in common.
struct Worker<'a> {
    state: &'a AppState,
    /// Of tracks that begin.
    params: &'a Params,
}

impl Worker<'_> {
    /// One answer is kept: the last.
    fn restore(&self, snapshot: &[u8]) -> Result<SessionState, SnapshotError> {
        SessionState::restore(snapshot, &self.state.access.snapshots, 1)
    }

    /// The track of a target, up to this frame.
    fn step(
        &self,
        target: &Target,
        frames: &[(Fingerprint, Frame); 1],
        meter: &mut WorkMeter,
    ) -> Result<SessionState, Problem> {
        meter.check()?;
        let snapshot = match target {
            Target::New(rect) => {
                let [(fingerprint, frame)] = frames;
                let begun = SessionState::start(
                    frame,
                    *fingerprint,
                    &PerTarget::One(*rect),
                    self.params,
                    || Ok(()),
                );
                return Ok(begun?);
            }
            Target::Known(snapshot) => snapshot,
        };
        let mut track = self.restore(snapshot)?;
        let before = track.latest();
        let answered = track.advance(frames, None, meter, 0, None);
        let estimates = answered.map_err(|error| match error {
            StepError::Refused { error, .. } => Problem::from(error),
            StepError::Stopped(stopped) => stopped.into(),
        })?;
        self.state
            .metrics
            .tracking
            .tracked(&before, &estimates, &meter.take_steps());
        Ok(track)
    }
}
