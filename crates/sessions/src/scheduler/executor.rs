//! Where the work of requests runs: on the threads that decode and track, or where a simulation runs it.
//!
//! A thread keeps a megabyte or more of buffers from one frame to the next. So work goes to the thread that became idle
//! last: its buffers are most likely still in the caches of its core.

use super::flows::{SizeClass, max_begun};
use crate::sync::{Condvar, Mutex, PoisonError, lock, thread};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;
use std::{fmt, io};

/// What runs work. Clones share the threads.
#[derive(Clone)]
pub struct Executor(Kind);

#[derive(Clone)]
enum Kind {
    /// The threads for small and for large work.
    Threads(Arc<[Workers; 2]>),
    Given(Arc<dyn Fn(Work) + Send + Sync>),
}

/// How many threads `workers` workers of one class need: further ones for work that has begun and waits between two
/// frames.
pub fn threads_of(workers: usize) -> usize {
    workers + max_begun(workers)
}

impl Executor {
    /// Threads for `workers` workers of each class.
    ///
    /// # Errors
    /// The system gives no more threads.
    pub fn threads(workers: usize) -> io::Result<Self> {
        // Work on several frames keeps its thread while it waits between two of them.
        let threads = |class: SizeClass| Workers::new(threads_of(workers), class.niceness());
        let threads = [threads(SizeClass::Small)?, threads(SizeClass::Large)?];
        Ok(Self(Kind::Threads(Arc::new(threads))))
    }

    /// Hands each piece of work to `start`, which runs it when it likes, all on one thread. So that each run of a
    /// simulation is the same, work counts as taking no processor time, and never gives way to other work.
    pub fn on_one_thread(start: impl Fn(Work) + Send + Sync + 'static) -> Self {
        Self(Kind::Given(Arc::new(start)))
    }

    /// Runs work that has been given a worker of this class.
    pub(super) fn start(&self, class: SizeClass, work: Work) {
        match &self.0 {
            Kind::Threads(threads) => threads[class as usize].start(work),
            Kind::Given(start) => start(work),
        }
    }

    /// The clock of the processor time of this executor's work.
    pub(super) fn cpu_clock(&self) -> CpuClock {
        match self.0 {
            Kind::Threads(_) => CpuClock::Thread,
            Kind::Given(_) => CpuClock::Still,
        }
    }
}

impl fmt::Debug for Executor {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0 {
            Kind::Threads(threads) => write!(formatter, "{threads:?}"),
            Kind::Given(_) => formatter.write_str("one thread"),
        }
    }
}

/// The clock of the processor time of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CpuClock {
    /// The processor time of the thread that asks.
    Thread,
    /// All work counts as taking no processor time.
    Still,
}

impl CpuClock {
    /// Processor time since some fixed moment.
    pub(super) fn now(self) -> Duration {
        match self {
            Self::Thread => thread_cpu_time(),
            Self::Still => Duration::ZERO,
        }
    }
}

/// Processor time of this thread since some fixed moment.
#[cfg(all(unix, not(feature = "shuttle")))]
fn thread_cpu_time() -> Duration {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::ThreadCPUTime);
    let seconds = u64::try_from(time.tv_sec).unwrap_or(0);
    let nanoseconds = u32::try_from(time.tv_nsec).unwrap_or(0);
    Duration::new(seconds, nanoseconds)
}

/// On other systems the time that has passed stands in for the processor time.
#[cfg(all(not(unix), not(feature = "shuttle")))]
fn thread_cpu_time() -> Duration {
    use crate::clock::{self, Instant};
    use std::sync::OnceLock;
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(clock::now).elapsed()
}

/// Where a test chooses the order of threads, it also draws their processor time: 0 to 7 ms between two calls.
#[cfg(feature = "shuttle")]
fn thread_cpu_time() -> Duration {
    use shuttle::rand::{Rng, thread_rng};
    use std::cell::Cell;
    thread_local! {
        static TAKEN: Cell<u64> = const { Cell::new(0) };
    }
    TAKEN.set(TAKEN.get() + thread_rng().gen_range(0..8));
    Duration::from_millis(TAKEN.get())
}

/// Work of a request. It returns what is to be done once its thread can be given the next work. Neither may panic.
pub type Work = Box<dyn FnOnce() -> AfterWork + Send>;
/// A job that follows [`Work`] on the same thread.
pub type AfterWork = Box<dyn FnOnce()>;

/// The threads. When this is dropped each ends after its current job, once no job waits.
pub(super) struct Workers(Arc<Shared>);

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<Work>,
    /// The slots of the idle threads, in the order in which these became idle.
    idle: Vec<Arc<ParkingSlot>>,
    closed: bool,
}

impl Workers {
    /// `threads` threads, whose priority is lower by `niceness` than that of this thread. All start now, since a thread
    /// has the priority of the one that starts it.
    ///
    /// # Errors
    /// The system gives no more threads.
    pub(super) fn new(threads: usize, niceness: i32) -> io::Result<Self> {
        let workers = Self(Arc::default());
        for _ in 0..threads {
            let shared = workers.0.clone();
            let thread = thread::Builder::new().name("bagtrack-worker".to_owned());
            thread.spawn(move || shared.serve(niceness))?;
        }
        Ok(workers)
    }

    /// Runs `job` on a thread: at once if one is idle, else after the jobs that wait already.
    pub(super) fn start(&self, job: Work) {
        let mut state = lock(&self.0.state);
        match state.idle.pop() {
            Some(slot) => {
                drop(state);
                slot.give(Some(job));
            }
            None => state.waiting.push_back(job),
        }
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        let mut state = lock(&self.0.state);
        state.closed = true;
        let idle = std::mem::take(&mut state.idle);
        drop(state);
        idle.iter().for_each(|slot| slot.give(None));
    }
}

impl fmt::Debug for Workers {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let idle = lock(&self.0.state).idle.len();
        write!(formatter, "Workers({idle} idle)")
    }
}

impl Shared {
    /// The main loop of a thread. The thread counts as idle before it runs a job's [`AfterWork`], so a job that this
    /// starts runs on the same thread.
    fn serve(&self, niceness: i32) {
        lower_priority(niceness);
        let slot = Arc::new(ParkingSlot::default());
        let mut after: AfterWork = Box::new(|| ());
        loop {
            let Some(job) = self.next(&slot, after) else {
                return;
            };
            after = job();
        }
    }

    /// The next job; none when the thread is to end.
    fn next(&self, slot: &Arc<ParkingSlot>, after: AfterWork) -> Option<Work> {
        let mut state = lock(&self.state);
        let waiting = state.waiting.pop_front();
        if waiting.is_some() || state.closed {
            drop(state);
            after();
            return waiting;
        }
        state.idle.push(slot.clone());
        drop(state);
        after();
        slot.wait()
    }
}

/// Lowers the priority of this thread. On other systems than Linux, `nice` would lower that of the process.
#[cfg(target_os = "linux")]
fn lower_priority(niceness: i32) {
    // With the feature `shuttle` all threads run on the test's own.
    if niceness > 0
        && cfg!(not(feature = "shuttle"))
        && let Err(error) = rustix::process::nice(niceness)
    {
        tracing::warn!(%error, "slow work has the priority of quick work");
    }
}

#[cfg(not(target_os = "linux"))]
fn lower_priority(_: i32) {}

/// Where one idle thread waits for a job, or for `None`, which tells it to end.
#[derive(Default)]
struct ParkingSlot {
    given: Mutex<Option<Option<Work>>>,
    filled: Condvar,
}

impl ParkingSlot {
    fn give(&self, job: Option<Work>) {
        *lock(&self.given) = Some(job);
        self.filled.notify_one();
    }

    fn wait(&self) -> Option<Work> {
        let mut given = lock(&self.given);
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

    fn job(work: impl FnOnce() + Send + 'static) -> Work {
        Box::new(|| {
            work();
            Box::new(|| ())
        })
    }

    #[test]
    fn jobs_share_the_threads_and_all_are_done() {
        let workers = Workers::new(2, 0).expect("two threads");
        let (done, finished) = mpsc::channel();
        for index in 0..50 {
            let done = done.clone();
            workers.start(job(move || {
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
        let workers = Workers::new(1, 0).expect("a thread");
        let shared = Arc::downgrade(&workers.0);
        let (go, wait) = mpsc::channel::<()>();
        let (done, finished) = mpsc::channel();
        let second = done.clone();
        workers.start(job(move || {
            wait.recv().expect("the test says when");
            done.send(1).expect("the test waits");
        }));
        workers.start(job(move || second.send(2).expect("the test waits")));
        drop(workers);
        go.send(()).expect("the job waits");
        assert_eq!(finished.iter().collect::<Vec<u32>>(), [1, 2]);
        while shared.strong_count() > 0 {
            thread::yield_now();
        }
    }
}
