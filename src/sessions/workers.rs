//! The threads that decode and track. Each is started when there is work for it, up to a maximum.
//!
//! A thread keeps a megabyte or more of buffers from one frame to the next. So work goes to the thread that became idle
//! last: its buffers are most likely still in the caches of its core.

use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Work. It must not panic.
type Job = Box<dyn FnOnce() + Send>;

/// The threads. When this is dropped each ends after its current job, once no job waits.
pub(super) struct Workers(Arc<Shared>);

struct Shared {
    state: Mutex<State>,
    max_threads: usize,
    /// By how much lower their priority is than that of the process.
    niceness: i32,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<Job>,
    /// One for each idle thread, in the order in which they became idle.
    idle: Vec<Arc<ParkingSlot>>,
    threads: usize,
    closed: bool,
}

impl Workers {
    /// At most `max_threads` threads, whose priority is lower by `niceness`; none is started yet.
    pub(super) fn new(max_threads: usize, niceness: i32) -> Self {
        Self(Arc::new(Shared {
            state: Mutex::default(),
            max_threads,
            niceness,
        }))
    }

    /// Runs `job` on a thread: at once if one is idle or can be started, else after the jobs that wait already. Drops
    /// the job if there is no thread at all and the system gives none.
    pub(super) fn start(&self, job: Job) {
        let mut state = self.0.lock();
        if let Some(slot) = state.idle.pop() {
            drop(state);
            return slot.give(Some(job));
        }
        if state.threads < self.0.max_threads {
            let shared = self.0.clone();
            let thread = std::thread::Builder::new().name("bagtrack-worker".to_owned());
            match thread.spawn(move || shared.serve()) {
                Ok(_) => state.threads += 1,
                Err(error) => tracing::error!(%error, "cannot start a worker"),
            }
        }
        if state.threads > 0 {
            state.waiting.push_back(job);
        }
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        let mut state = self.0.lock();
        state.closed = true;
        let idle = std::mem::take(&mut state.idle);
        drop(state);
        idle.iter().for_each(|slot| slot.give(None));
    }
}

impl fmt::Debug for Workers {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let threads = self.0.lock().threads;
        write!(formatter, "Workers({threads} of {})", self.0.max_threads)
    }
}

impl Shared {
    /// The main loop of a thread.
    fn serve(&self) {
        lower_priority(self.niceness);
        let slot = Arc::new(ParkingSlot::default());
        while let Some(job) = self.next(&slot) {
            job();
        }
    }

    /// The next job; none when the thread is to end.
    fn next(&self, slot: &Arc<ParkingSlot>) -> Option<Job> {
        let mut state = self.lock();
        if let Some(job) = state.waiting.pop_front() {
            return Some(job);
        }
        if state.closed {
            return None;
        }
        state.idle.push(slot.clone());
        drop(state);
        slot.wait()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it is held.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Lowers the priority of this thread. Elsewhere than in Linux it would be that of the process.
#[cfg(target_os = "linux")]
fn lower_priority(niceness: i32) {
    if niceness > 0
        && let Err(error) = rustix::process::nice(niceness)
    {
        tracing::warn!(%error, "slow work has the priority of quick work");
    }
}

#[cfg(not(target_os = "linux"))]
fn lower_priority(_: i32) {}

/// Where one idle thread waits for a job, or for None, which tells it to end.
#[derive(Default)]
struct ParkingSlot {
    given: Mutex<Option<Option<Job>>>,
    filled: Condvar,
}

impl ParkingSlot {
    fn give(&self, job: Option<Job>) {
        *self.given.lock().unwrap_or_else(PoisonError::into_inner) = Some(job);
        self.filled.notify_one();
    }

    fn wait(&self) -> Option<Job> {
        let mut given = self.given.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if let Some(job) = given.take() {
                return job;
            }
            given = self
                .filled
                .wait(given)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;
    use std::sync::mpsc;
    use std::thread::{self, ThreadId};

    #[test]
    fn jobs_share_the_threads_and_all_are_done() {
        let workers = Workers::new(2, 0);
        let (done, finished) = mpsc::channel();
        for index in 0..50 {
            let done = done.clone();
            workers.start(Box::new(move || {
                done.send((index, thread::current().id()))
                    .expect("the test waits");
            }));
        }
        let (mut jobs, threads): (Vec<u32>, HashSet<ThreadId>) = finished.iter().take(50).unzip();
        jobs.sort_unstable();
        assert_eq!(jobs, (0..50).collect::<Vec<u32>>());
        assert!(threads.len() <= 2, "{threads:?}");
    }

    #[test]
    fn what_waits_is_done_after_the_pool_was_dropped_and_then_the_threads_end() {
        let workers = Workers::new(1, 0);
        let shared = Arc::downgrade(&workers.0);
        let (go, wait) = mpsc::channel::<()>();
        let (done, finished) = mpsc::channel();
        let second = done.clone();
        workers.start(Box::new(move || {
            wait.recv().expect("the test says when");
            done.send(1).expect("the test waits");
        }));
        workers.start(Box::new(move || second.send(2).expect("the test waits")));
        drop(workers);
        go.send(()).expect("the job waits");
        assert_eq!(finished.iter().collect::<Vec<u32>>(), [1, 2]);
        while shared.strong_count() > 0 {
            thread::yield_now();
        }
    }
}
