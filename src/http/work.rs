//! Work on the worker threads, with the time that a request may take.
//!
//! The deadline ends the waiting, not the work. Work that has begun runs to its end with its permits and the session's
//! lock. The client gets its answer by sending the frame again with its number.

use super::problems::problem::Problem;
use super::state::AppState;
use crate::sessions::{LockedSession, QueuePermit, SessionPermit};
use std::time::Instant;
use tokio::time::timeout;

/// Runs `work` on a worker.
pub async fn run<T, F>(state: &AppState, queue: QueuePermit, work: F) -> Result<T, Problem>
where
    T: Send + 'static,
    F: FnOnce() -> Result<T, Problem> + Send + 'static,
{
    let (asked, waited) = (Instant::now(), state.metrics.queue_wait.clone());
    let work = move || {
        waited.record(asked.elapsed().as_secs_f64());
        work()
    };
    match timeout(state.config.work_timeout, state.admission.run(queue, work)).await {
        Ok(outcome) => outcome?,
        Err(_) => Err(Problem::work_timeout()),
    }
}

/// Waits for the session in order of arrival, then runs `work` with it on a worker.
pub async fn on_session<T, F>(
    state: &AppState,
    permit: SessionPermit,
    queue: QueuePermit,
    work: F,
) -> Result<T, Problem>
where
    T: Send + 'static,
    F: FnOnce(&mut LockedSession) -> Result<T, Problem> + Send + 'static,
{
    let (asked, waited) = (Instant::now(), state.metrics.queue_wait.clone());
    let waiting = async {
        let mut locked = permit.lock().await?;
        state
            .admission
            .run(queue, move || {
                waited.record(asked.elapsed().as_secs_f64());
                work(&mut locked)
            })
            .await?
    };
    timeout(state.config.work_timeout, waiting)
        .await
        .map_err(|_| Problem::work_timeout())?
}
