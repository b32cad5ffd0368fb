//! When work on several frames stops early: between two of them.
//!
//! A thread cannot be stopped from outside. So the work itself asks, before each frame, whether it should go on. There
//! it also lets other clients' requests go first.

use super::cpu_time::thread_cpu_time;
use super::fair_queue::Turn;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Why work was stopped. What it had done was undone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Stopped {
    /// Nobody waits for the answer any more.
    #[error("the client has gone")]
    Abandoned,
    /// The time of the request is over.
    #[error("the deadline has passed")]
    Deadline,
    /// The work took more processor time than a request may; the number is that maximum.
    #[error("the work took more than {0:?} of processor time")]
    Cost(Duration),
}

/// What a request's work may take. Clones share whether it was abandoned.
#[derive(Debug, Clone)]
pub struct WorkLimit {
    deadline: Instant,
    max_cpu: Duration,
    abandoned: Arc<AtomicBool>,
}

impl WorkLimit {
    /// Until `deadline`, with at most `max_cpu` of processor time.
    pub fn new(deadline: Instant, max_cpu: Duration) -> Self {
        Self {
            deadline,
            max_cpu,
            abandoned: Arc::default(),
        }
    }

    /// The work counts as abandoned when the returned value is dropped.
    pub fn abandon_on_drop(&self) -> AbandonOnDrop {
        AbandonOnDrop(self.abandoned.clone())
    }

    /// Begins to count this thread's processor time, while the work has this turn.
    pub fn start<'a>(&'a self, turn: &'a mut Turn) -> WorkMeter<'a> {
        WorkMeter {
            limit: self,
            turn,
            started: thread_cpu_time(),
        }
    }
}

/// Marks work as abandoned when it is dropped.
#[derive(Debug)]
pub struct AbandonOnDrop(Arc<AtomicBool>);

impl Drop for AbandonOnDrop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

/// Counts what work takes on this thread.
#[derive(Debug)]
pub struct WorkMeter<'a> {
    limit: &'a WorkLimit,
    turn: &'a mut Turn,
    started: Duration,
}

impl WorkMeter<'_> {
    /// Processor time that the work has taken.
    pub fn cpu_time(&self) -> Duration {
        thread_cpu_time().saturating_sub(self.started)
    }

    /// Whether the work may go on. Waits while requests of clients with a better claim have its worker.
    ///
    /// # Errors
    /// It may not.
    pub fn check(&mut self) -> Result<(), Stopped> {
        let limit = self.limit;
        self.turn.step_back();
        if limit.abandoned.load(Ordering::Acquire) {
            return Err(Stopped::Abandoned);
        }
        if Instant::now() >= limit.deadline {
            return Err(Stopped::Deadline);
        }
        if self.cpu_time() > limit.max_cpu {
            return Err(Stopped::Cost(limit.max_cpu));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::fair_queue::FairQueue;
    use super::super::lanes::{Lane, Length};
    use super::*;

    const LONG: Duration = Duration::from_secs(600);

    #[tokio::test]
    async fn each_limit_stops_the_work() {
        let mut turn = FairQueue::new(1).ask(Lane(0), Length::Short).await.unwrap();
        let soon = || Instant::now() + LONG;
        let limit = WorkLimit::new(soon(), LONG);
        let client = limit.abandon_on_drop();
        assert_eq!(limit.start(&mut turn).check(), Ok(()));
        drop(client);
        assert_eq!(limit.start(&mut turn).check(), Err(Stopped::Abandoned));
        let late = WorkLimit::new(Instant::now(), LONG);
        assert_eq!(late.start(&mut turn).check(), Err(Stopped::Deadline));
        let limit = WorkLimit::new(soon(), Duration::from_micros(10));
        let mut meter = limit.start(&mut turn);
        let mut checked = meter.check();
        while checked.is_ok() {
            checked = meter.check();
        }
        assert_eq!(checked, Err(Stopped::Cost(Duration::from_micros(10))));
    }
}
