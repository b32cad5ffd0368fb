//! Bounds of one request's work. Work on several frames stops early between two of them.
//!
//! A thread cannot be stopped from outside. So the work itself asks, before each frame, whether it should go on. At
//! these moments it also lets other clients' requests go first.

use super::executor::CpuClock;
use super::fair_queue::WorkerSlot;
use super::side_by_side::Parts;
use crate::clock::{self, Instant};
use crate::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::Arc;
use std::time::Duration;

/// Why work was stopped. What it had done does not count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Stopped {
    /// Nobody waits for the answer any more.
    #[error("the client has gone")]
    Abandoned,
    /// The work was not begun: the client's requests wait too long for a worker.
    #[error("the client's requests wait too long")]
    Overload,
    /// The time of the request is over.
    #[error("the deadline has passed")]
    Deadline,
    /// The work took more processor time than a request may; the number is that maximum.
    #[error("the work took more than {0:?} of processor time")]
    Cost(Duration),
}

/// Processor time that the work of one request has taken. Clones share the count.
#[derive(Debug, Clone, Default)]
pub struct CpuSpent(Arc<AtomicU64>);

impl CpuSpent {
    fn total(&self) -> Duration {
        Duration::from_nanos(self.0.load(Ordering::Relaxed))
    }

    fn add(&self, time: Duration) {
        let nanos = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        self.0.fetch_add(nanos, Ordering::Relaxed);
    }
}

/// The deadline and the processor time that a request's work may take. Clones share whether the work was abandoned.
#[derive(Debug, Clone)]
pub struct WorkLimit {
    deadline: Instant,
    max_cpu: Duration,
    spent: CpuSpent,
    abandoned: Arc<AtomicBool>,
}

impl WorkLimit {
    /// Lets work go on until `deadline`, with at most `max_cpu` of processor time. `spent` is what the request took of
    /// it before.
    pub fn new(deadline: Instant, max_cpu: Duration, spent: CpuSpent) -> Self {
        Self {
            deadline,
            max_cpu,
            spent,
            abandoned: Arc::default(),
        }
    }

    /// The work counts as abandoned when the returned value is dropped.
    pub fn abandon_on_drop(&self) -> AbandonOnDrop {
        AbandonOnDrop(self.abandoned.clone())
    }

    /// Begins to count this thread's processor time, for work that has the worker `turn`.
    pub fn start<'a>(&'a self, turn: &'a mut WorkerSlot) -> WorkMeter<'a> {
        let cpu = turn.cpu();
        WorkMeter {
            limit: self,
            turn,
            cpu,
            started: cpu.now(),
            elsewhere: Duration::ZERO,
            steps: Vec::new(),
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

/// Counts the processor time of work, and stops it at its limits.
#[derive(Debug)]
pub struct WorkMeter<'a> {
    limit: &'a WorkLimit,
    turn: &'a mut WorkerSlot,
    cpu: CpuClock,
    started: Duration,
    /// Processor time that the work took on other threads.
    elsewhere: Duration,
    steps: Vec<Duration>,
}

impl WorkMeter<'_> {
    /// Does a step of the work, and notes its processor time.
    pub fn step<T>(&mut self, step: impl FnOnce() -> T) -> T {
        let before = self.cpu.now();
        let result = step();
        self.steps.push(self.cpu.now().saturating_sub(before));
        result
    }

    /// Does `step` to each of `parts`, here and on workers that are idle, and notes its processor time. Before each
    /// part that is done on this thread it [checks](Self::check) whether the work may go on. The parts come back in
    /// their order, and the results of those that were done.
    ///
    /// # Panics
    /// With the panic of a step.
    pub fn side_by_side<T, R>(
        &mut self,
        parts: Vec<T>,
        step: impl Fn(&mut T) -> R + Send + Sync + 'static,
    ) -> (Vec<T>, Result<Vec<R>, Stopped>)
    where
        T: Send + 'static,
        R: Send + 'static,
    {
        let others = parts.len().saturating_sub(1);
        let parts = Arc::new(Parts::new(parts, step, self.cpu));
        for _ in 0..others {
            let shared = parts.clone();
            if !self.turn.share(move || shared.work().is_some()) {
                break;
            }
        }
        let mut here = Duration::ZERO;
        let stopped = loop {
            let may_go_on = self.check();
            match may_go_on.is_ok().then(|| parts.work()).flatten() {
                Some(time) => here += time,
                None => break may_go_on,
            }
        };
        let (parts, done): (Vec<T>, Vec<_>) = parts.end().into_iter().unzip();
        let (results, times): (Vec<R>, Vec<_>) = done.into_iter().flatten().unzip();
        let all: Duration = times.iter().sum();
        self.elsewhere += all.saturating_sub(here);
        self.steps.extend(times);
        (parts, stopped.map(|()| results))
    }

    /// The processor time of each step since this was asked last.
    pub fn take_steps(&mut self) -> Vec<Duration> {
        std::mem::take(&mut self.steps)
    }

    /// Processor time that the work has taken, on all threads.
    pub fn cpu_time(&self) -> Duration {
        self.cpu.now().saturating_sub(self.started) + self.elsewhere
    }

    /// Whether the work may go on. Waits while requests of clients with a better claim have its worker.
    ///
    /// # Errors
    /// The work has to stop, for the reason that the error gives.
    pub fn check(&mut self) -> Result<(), Stopped> {
        let limit = self.limit;
        self.turn.yield_to_others();
        if limit.abandoned.load(Ordering::Acquire) {
            return Err(Stopped::Abandoned);
        }
        if clock::now() >= limit.deadline {
            return Err(Stopped::Deadline);
        }
        if limit.spent.total() + self.cpu_time() > limit.max_cpu {
            return Err(Stopped::Cost(limit.max_cpu));
        }
        Ok(())
    }
}

impl Drop for WorkMeter<'_> {
    fn drop(&mut self) {
        self.limit.spent.add(self.cpu_time());
    }
}

#[cfg(test)]
mod tests {
    use super::super::fair_queue::FairQueue;
    use super::super::flows::{Flow, Job};
    use super::*;

    const LONG: Duration = Duration::from_secs(600);

    #[tokio::test]
    async fn each_limit_stops_the_work() {
        let mut turn = FairQueue::new(1, std::time::Duration::ZERO)
            .ask(Flow(0), Job::Single)
            .await
            .unwrap();
        let soon = || clock::now() + LONG;
        let limit = WorkLimit::new(soon(), LONG, CpuSpent::default());
        let client = limit.abandon_on_drop();
        assert_eq!(limit.start(&mut turn).check(), Ok(()));
        drop(client);
        assert_eq!(limit.start(&mut turn).check(), Err(Stopped::Abandoned));
        let late = WorkLimit::new(clock::now(), LONG, CpuSpent::default());
        assert_eq!(late.start(&mut turn).check(), Err(Stopped::Deadline));
        let limit = WorkLimit::new(soon(), Duration::from_micros(10), CpuSpent::default());
        let mut meter = limit.start(&mut turn);
        let mut checked = meter.check();
        while checked.is_ok() {
            checked = meter.check();
        }
        assert_eq!(checked, Err(Stopped::Cost(Duration::from_micros(10))));
        // The request's next work finds the processor time used up, too.
        drop(meter);
        let next = limit.start(&mut turn).check();
        assert_eq!(next, Err(Stopped::Cost(Duration::from_micros(10))));
    }
}
