//! Work off the async threads: decoding and tracking, with the time that a request may take.
//!
//! The deadline ends the waiting, not the work: what has begun runs to its end with its permits and the
//! session's lock, and its answer can be had by sending the frame again with its number.

use super::problem::Problem;
use super::state::AppState;
use crate::ingest;
use crate::sessions::{Locked, Place, QueuePermit, Session};
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

/// Waits for the session in order of arrival, then runs `work` with its state on a worker, or where it is where it is
/// brief.
pub async fn on_session<T, F>(
    state: &AppState,
    place: Place,
    queue: QueuePermit,
    is_brief: bool,
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
        let done = if is_brief {
            state.admission.run_brief(queue, work).await
        } else {
            state.admission.run(queue, work).await
        };
        done.map_err(|lost| Problem::internal(Arc::new(lost)))?
    };
    timeout(state.config.work_timeout, waiting)
        .await
        .map_err(|_| Problem::work_timeout())?
}

/// Whether these frames, the next of the session, are work of a few milliseconds at most: one plain frame of the session's size,
/// where the last one was so, too.
pub fn is_brief(session: &Session, frames: &[Bytes]) -> bool {
    let [frame] = frames else { return false };
    let (width, height) = session.source_size();
    let size = session.is_brief().then(|| ingest::plain_size(frame));
    // As stored: its sides may have to change places.
    size.flatten()
        .is_some_and(|size| [(width, height), (height, width)].contains(&size))
}

/// Decodes the frames of a request: all of them, or the problem of the first bad one.
pub fn decode(frames: &[Bytes], limits: &ingest::Limits) -> Result<Vec<GrayFrame>, Problem> {
    let decode_one = |(index, bytes): (usize, &Bytes)| {
        ingest::decode(bytes, limits)
            .map_err(|error| Problem::ingest(&error).of_frame(index, frames.len()))
    };
    frames.iter().enumerate().map(decode_one).collect()
}
