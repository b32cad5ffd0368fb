//! The processor time of a thread.

use std::time::Duration;

/// What measures the processor time of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CpuClock {
    /// The processor time of the thread that asks.
    Thread,
    /// Work takes none.
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

/// Elsewhere the time of day stands in for it.
#[cfg(all(not(unix), not(feature = "shuttle")))]
fn thread_cpu_time() -> Duration {
    use crate::clock::{self, Instant};
    use std::sync::OnceLock;
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(clock::now).elapsed()
}

/// Where a test chooses the order of threads, it chooses what they take too: some milliseconds between two questions.
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
