//! Work off the async threads: decoding and tracking, with the time that a request may take.
//!
//! The deadline ends the waiting, not the work: what has begun runs to its end with its permits and the
//! session's lock, and its answer can be had by sending the frame again with its number.

use super::problem::Problem;
use super::state::AppState;
use crate::ingest;
use crate::sessions::{Locked, Place, QueuePermit};
use crate::tracker::GrayFrame;
use axum::body::Bytes;
use std::sync::Arc;
use tokio::time::timeout;

/// Runs `work` on a worker.
pub async fn run<T, F>(state: &AppState, queue: QueuePermit, work: F) -> Result<T, Problem>
where
    T: Send + 'static,
    F: FnOnce() -> Result<T, Problem> + Send + 'static,
{
    match timeout(state.config.work_timeout, state.admission.run(queue, work)).await {
        Ok(Ok(result)) => result,
        Ok(Err(lost)) => Err(Problem::internal(Arc::new(lost))),
        Err(_) => Err(Problem::work_timeout()),
    }
}

/// Waits for the session in order of arrival, then runs `work` with its state on a worker.
pub async fn on_session<T, F>(
    state: &AppState,
    place: Place,
    queue: QueuePermit,
    work: F,
) -> Result<T, Problem>
where
    T: Send + 'static,
    F: FnOnce(&mut Locked) -> Result<T, Problem> + Send + 'static,
{
    let waiting = async {
        let mut locked = place
            .lock()
            .await
            .map_err(|_| Problem::session_not_found())?;
        let work = move || work(&mut locked);
        let done = state.admission.run(queue, work).await;
        done.map_err(|lost| Problem::internal(Arc::new(lost)))?
    };
    timeout(state.config.work_timeout, waiting)
        .await
        .map_err(|_| Problem::work_timeout())?
}

/// Decodes the frames of a request: all of them, or the problem of the first bad one.
pub fn decode(frames: &[Bytes], limits: &ingest::Limits) -> Result<Vec<GrayFrame>, Problem> {
    let decode_one = |(index, bytes): (usize, &Bytes)| {
        ingest::decode(bytes, limits)
            .map_err(|error| Problem::ingest(&error).of_frame(index, frames.len()))
    };
    frames.iter().enumerate().map(decode_one).collect()
}
