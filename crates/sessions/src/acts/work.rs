//! Work on the worker threads, with the time that a request may take.
//!
//! The deadline ends the waiting at once. Work that has begun looks at it between frames, and at whether its client has
//! gone. Until it has ended it keeps its permits and the session's lock.

use super::service::SessionService;
use crate::clock::{self, timeout};
use crate::{NoOutcome, QueuePermit, Stopped, WorkLimit, WorkMeter, WorkPanicked};

impl SessionService {
    /// Runs `work` on a worker.
    ///
    /// # Errors
    /// Its time is over, it waited too long for a worker, it panicked, or its own error.
    pub async fn run<T, E, F>(&self, queue: QueuePermit, work: F) -> Result<T, E>
    where
        T: Send + 'static,
        E: From<Stopped> + From<WorkPanicked> + Send + 'static,
        F: FnOnce(&mut WorkMeter) -> Result<T, E> + Send + 'static,
    {
        let deadline = clock::now() + self.settings.work_timeout;
        let max_cpu = self.settings.max_request_cpu;
        let max_cpu = max_cpu.saturating_mul(queue.cpu_share());
        let limit = WorkLimit::new(deadline, max_cpu, queue.spent().clone());
        let _client = limit.abandon_on_drop();
        let (asked, waited) = (clock::now(), self.queue_wait.clone());
        let work = self.admission.run(queue, move |turn| {
            waited.record(asked.elapsed().as_secs_f64());
            work(&mut limit.start(turn))
        });
        match timeout(self.settings.work_timeout, work).await {
            Ok(Ok(done)) => done,
            Ok(Err(NoOutcome::Overload)) => Err(Stopped::Overload.into()),
            Ok(Err(NoOutcome::Panicked(panicked))) => Err(panicked.into()),
            Err(_) => Err(Stopped::Deadline.into()),
        }
    }
}
