//! Where the work of requests runs: on worker threads, or where a simulation runs it.

use super::cpu_time::CpuClock;
use super::flows::{SizeClass, max_begun};
use super::workers::{Work, Workers};
use std::sync::Arc;
use std::{fmt, io};

/// What runs work. Clones are the same.
#[derive(Clone)]
pub struct Executor(Kind);

#[derive(Clone)]
enum Kind {
    /// The threads of each class.
    Threads(Arc<[Workers; 2]>),
    Given(Arc<dyn Fn(Work) + Send + Sync>),
}

/// The threads for so many workers of one class.
pub fn threads_of(workers: usize) -> usize {
    workers + max_begun(workers)
}

impl Executor {
    /// The threads of so many workers of each class.
    ///
    /// # Errors
    /// The system gives no more threads.
    pub fn threads(workers: usize) -> io::Result<Self> {
        // Of work on several frames, what has begun may wait between two of them.
        let threads = |class: SizeClass| Workers::new(threads_of(workers), class.niceness());
        let threads = [threads(SizeClass::Small)?, threads(SizeClass::Large)?];
        Ok(Self(Kind::Threads(Arc::new(threads))))
    }

    /// What runs each work when it likes, all on one thread. So that it does the same each time, its work counts as
    /// taking no processor time, and never stops for other work.
    pub fn on_one_thread(start: impl Fn(Work) + Send + Sync + 'static) -> Self {
        Self(Kind::Given(Arc::new(start)))
    }

    /// Runs work, for which this class of workers has been given.
    pub(super) fn start(&self, class: SizeClass, work: Work) {
        match &self.0 {
            Kind::Threads(threads) => threads[class as usize].start(work),
            Kind::Given(start) => start(work),
        }
    }

    /// What measures the processor time of its work.
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
