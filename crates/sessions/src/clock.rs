//! The time by which sessions expire: the monotonic clock. It can be moved forward, so tests need not wait.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime};

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
            start: Instant::now(),
            advanced_ms: Arc::default(),
            wall: SystemTime::now,
        }
    }
}

impl Clock {
    /// One whose time of day is this.
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

    /// The wall-clock time of a moment of this clock; none before 1970, which machines without a battery begin in.
    pub fn wall(&self, moment: Duration) -> SystemTime {
        let now = self.now();
        let advanced = Duration::from_millis(self.advanced_ms.load(Ordering::Relaxed));
        let since_1970 = (self.wall)().duration_since(SystemTime::UNIX_EPOCH);
        let wall_now = since_1970.unwrap_or_default() + advanced;
        let wall = (wall_now + moment).saturating_sub(now);
        SystemTime::UNIX_EPOCH + wall
    }
}
