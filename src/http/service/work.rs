//! Work on the worker threads, with the time that a request may take.
//!
//! The deadline ends the waiting at once. Work that has begun looks at it between frames, and at whether its client has
//! gone; then it undoes what it did. Until it has ended it keeps its permits and the session's lock.

use super::state::AppState;
use crate::http::problems::problem::Problem;
use crate::sessions::{LockedSession, QueuePermit, SessionPermit, WorkLimit, WorkMeter};
use std::time::Instant;
use tokio::time::timeout;

/// Runs `work` on a worker.
pub async fn run<T, F>(state: &AppState, queue: QueuePermit, work: F) -> Result<T, Problem>
where
    T: Send + 'static,
    F: FnOnce(&mut WorkMeter) -> Result<T, Problem> + Send + 'static,
{
    let limit = limit(state, &queue);
    let _client = limit.abandon_on_drop();
    let (asked, waited) = (Instant::now(), state.metrics.queue_wait.clone());
    let work = state.admission.run(queue, move |turn| {
        waited.record(asked.elapsed().as_secs_f64());
        work(&mut limit.start(turn))
    });
    timeout(state.config.work_timeout, work)
        .await
        .map_err(|_| Problem::work_timeout())??
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
    F: FnOnce(&mut LockedSession, &mut WorkMeter) -> Result<T, Problem> + Send + 'static,
{
    let limit = limit(state, &queue);
    let _client = limit.abandon_on_drop();
    let (asked, waited) = (Instant::now(), state.metrics.queue_wait.clone());
    let waiting = async {
        let mut locked = permit.lock().await?;
        state
            .admission
            .run(queue, move |turn| {
                waited.record(asked.elapsed().as_secs_f64());
                work(&mut locked, &mut limit.start(turn))
            })
            .await?
    };
    timeout(state.config.work_timeout, waiting)
        .await
        .map_err(|_| Problem::work_timeout())?
}

fn limit(state: &AppState, queue: &QueuePermit) -> WorkLimit {
    let deadline = Instant::now() + state.config.work_timeout;
    let max_cpu = state.config.limits.max_request_cpu;
    let max_cpu = max_cpu.saturating_mul(queue.cpu_share());
    WorkLimit::new(deadline, max_cpu, queue.spent().clone())
}
