//! The requests that wait, in a lane for each client, and which of them is next.

use std::collections::{HashMap, VecDeque};
use std::time::Duration;

/// Lanes above which those without work and without debt are forgotten.
const MAX_IDLE_LANES: usize = 1024;

/// Whose requests wait for each other only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Lane(pub u64);

/// All lanes. `G` is what gives a request its worker.
#[derive(Debug)]
pub(super) struct Lanes<G> {
    pub(super) free: usize,
    /// Requests with several frames that have begun and not ended, and how many may.
    pub(super) long: usize,
    max_long: usize,
    /// Time used by the lane that was served last, when it was served.
    pub(super) now: Duration,
    pub(super) lanes: HashMap<Lane, Waiting<G>>,
}

/// A lane.
#[derive(Debug)]
pub(super) struct Waiting<G> {
    pub(super) used: Duration,
    pub(super) running: usize,
    pub(super) requests: VecDeque<(Length, G)>,
}

/// How much work a request is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Length {
    /// One frame, or less.
    Short,
    /// Several frames.
    Long,
    /// Several frames, some of which are done.
    Begun,
}

impl<G> Lanes<G> {
    /// For so many workers, and as many requests with several frames that have begun.
    pub(super) fn new(workers: usize) -> Self {
        Self {
            free: workers,
            long: 0,
            max_long: workers,
            now: Duration::ZERO,
            lanes: HashMap::new(),
        }
    }

    pub(super) fn may_begin(&self, length: Length) -> bool {
        length != Length::Long || self.long < self.max_long
    }

    /// Whether the first request of a lane may have a worker.
    pub(super) fn is_next(&self, waiting: &Waiting<G>) -> bool {
        let first = waiting.requests.front();
        first.is_some_and(|(length, _)| self.may_begin(*length))
    }

    pub(super) fn next(&mut self) -> Option<(Lane, Length, G)> {
        let waiting = self.lanes.iter().filter(|(_, w)| self.is_next(w));
        let lane = *waiting.min_by_key(|(_, w)| (w.running, w.used))?.0;
        let (length, give) = self.lanes.get_mut(&lane)?.requests.pop_front()?;
        self.serve(lane, length);
        Some((lane, length, give))
    }

    pub(super) fn serve(&mut self, lane: Lane, length: Length) {
        self.long += usize::from(length == Length::Long);
        let waiting = self.lanes.entry(lane).or_default();
        waiting.running += 1;
        self.now = self.now.max(waiting.used);
    }

    pub(super) fn forget_idle_lanes(&mut self) {
        if self.lanes.len() > MAX_IDLE_LANES {
            let now = self.now;
            self.lanes
                .retain(|_, w| w.running > 0 || !w.requests.is_empty() || w.used > now);
        }
    }
}

impl<G> Default for Waiting<G> {
    fn default() -> Self {
        Self {
            used: Duration::ZERO,
            running: 0,
            requests: VecDeque::new(),
        }
    }
}
