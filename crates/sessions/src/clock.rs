//! The one place that asks for the time, and through which everything waits.
//!
//! Moments, sleeping and time-outs are tokio's, whose time a test pauses and moves (`start_paused`). Sessions expire by
//! a [`Clock`], which tests can move forward on its own, so a test of the whole service need not wait either.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};
pub use tokio::time::{
    Instant, MissedTickBehavior, Sleep, interval, interval_at, sleep, sleep_until, timeout,
    timeout_at,
};

/// The moment now.
#[allow(clippy::disallowed_methods)]
pub fn now() -> Instant {
    Instant::now()
}

/// The time of day.
#[allow(clippy::disallowed_methods)]
pub(crate) fn wall_now() -> SystemTime {
    SystemTime::now()
}

/// A monotonic clock that can be moved forward. Clones share the time.
#[derive(Debug, Clone)]
pub struct Clock {
    start: Instant,
    advanced_ms: Arc<AtomicU64>,
    wall: fn() -> SystemTime,
}

impl Default for Clock {
    fn default() -> Self {
        Self {
            start: now(),
            advanced_ms: Arc::default(),
            wall: wall_now,
        }
    }
}

impl Clock {
    /// A clock that takes the time of day from `wall`.
    pub fn with_wall(wall: fn() -> SystemTime) -> Self {
        Self {
            wall,
            ..Self::default()
        }
    }

    /// Time since the clock was made.
    pub fn now(&self) -> Duration {
        let advanced = Duration::from_millis(self.advanced_ms.load(Ordering::Relaxed));
        self.start.elapsed() + advanced
    }

    /// Moves the clock forward.
    pub fn advance(&self, by: Duration) {
        let ms = u64::try_from(by.as_millis()).unwrap_or(u64::MAX);
        self.advanced_ms.fetch_add(ms, Ordering::Relaxed);
    }

    /// The wall-clock time of a moment of this clock, at least 1970, in which machines without a battery begin.
    pub fn wall(&self, moment: Duration) -> SystemTime {
        SystemTime::UNIX_EPOCH + self.since_1970(moment)
    }

    /// The wall-clock time of a moment of this clock, as the time since the beginning of 1970.
    pub(crate) fn since_1970(&self, moment: Duration) -> Duration {
        let now = self.now();
        let advanced = Duration::from_millis(self.advanced_ms.load(Ordering::Relaxed));
        let since_1970 = (self.wall)().duration_since(SystemTime::UNIX_EPOCH);
        let wall_now = since_1970.unwrap_or_default() + advanced;
        (wall_now + moment).saturating_sub(now)
    }
}
