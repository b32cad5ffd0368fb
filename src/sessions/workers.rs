//! The threads that decode and track: as many as may work at the same time, each started when there is work for it.
//!
//! A thread keeps a megabyte or more of room from one frame to the next. So work goes to the thread that became idle last, in
//! whose caches that room still is; a pool that wakes its threads in turn works with cold ones.

use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Work that does not panic.
type Job = Box<dyn FnOnce() + Send>;

/// The threads. They end when this is dropped, each after the work that it is at.
pub(super) struct Workers(Arc<Shared>);

struct Shared {
    state: Mutex<State>,
    most: usize,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<Job>,
    /// Where the idle threads wait; the last one became idle last.
    idle: Vec<Arc<Seat>>,
    threads: usize,
    closed: bool,
}

impl Workers {
    /// At most `most` threads, none of them started yet.
    pub(super) fn new(most: usize) -> Self {
        let state = Mutex::default();
        Self(Arc::new(Shared { state, most }))
    }

    /// Has a thread do `job`: at once where one is idle or can be started, else after the jobs before it. The job is dropped
    /// where there is no thread, and the system does not give one.
    pub(super) fn start(&self, job: Job) {
        let mut state = self.0.lock();
        if let Some(seat) = state.idle.pop() {
            drop(state);
            return seat.give(Some(job));
        }
        if state.threads < self.0.most {
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
        idle.iter().for_each(|seat| seat.give(None));
    }
}

impl fmt::Debug for Workers {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let threads = self.0.lock().threads;
        write!(formatter, "Workers({threads} of {})", self.0.most)
    }
}

impl Shared {
    /// What a thread does.
    fn serve(&self) {
        let seat = Arc::new(Seat::default());
        while let Some(job) = self.next(&seat) {
            job();
        }
    }

    /// The next job; none when the thread is to end.
    fn next(&self, seat: &Arc<Seat>) -> Option<Job> {
        let mut state = self.lock();
        if let Some(job) = state.waiting.pop_front() {
            return Some(job);
        }
        if state.closed {
            return None;
        }
        state.idle.push(seat.clone());
        drop(state);
        seat.wait()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it is held.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Where one idle thread waits for a job, or for none to tell it that there will be no more.
#[derive(Default)]
struct Seat {
    given: Mutex<Option<Option<Job>>>,
    filled: Condvar,
}

impl Seat {
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
        let workers = Workers::new(2);
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
        let workers = Workers::new(1);
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
