//! The requests that wait, in a lane for each client, and which of them is next.

use std::collections::{HashMap, VecDeque};
use std::time::Duration;

/// Work that takes more processor time without a break makes its lane a slow one. It is some ten times what a frame of a
/// camera takes, and half of the time between two of them.
const SLOW: Duration = Duration::from_millis(15);
/// By how much the memory of the slowest work fades with each other work. A client that hides its slow work among quick
/// work needs a dozen requests of that for each.
const FADING: f64 = 0.9;
/// Lanes above which those without work and without debt are forgotten.
const MAX_IDLE_LANES: usize = 1024;

/// Whose requests wait for each other only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Lane(pub u64);

/// All lanes. `G` is what gives a request its worker.
#[derive(Debug)]
pub(super) struct Lanes<G> {
    /// Workers of each pace.
    workers: usize,
    /// Those at work, by their pace.
    running: [usize; 2],
    /// Requests with several frames that have begun and not ended, and how many may.
    pub(super) long: usize,
    max_long: usize,
    /// The virtual time: the greatest that a lane of each pace had used when it was served.
    now: [Duration; 2],
    pub(super) lanes: HashMap<Lane, Waiting<G>>,
    /// How often a request became the first of its lane.
    firsts: u64,
}

/// A lane.
#[derive(Debug)]
pub(super) struct Waiting<G> {
    pub(super) used: Duration,
    pub(super) running: usize,
    pub(super) requests: VecDeque<(Length, G)>,
    /// Orders lanes that have used the same time: those that start level are many.
    since: u64,
    /// The longest time that a worker was held lately.
    slowest: Duration,
}

/// Which workers a lane has. Quick work has workers of its own, so it never waits until slow work is done; the threads of
/// slow work have a lower priority. (Size-interval task assignment, with the past as the guess of the size.)
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pace {
    Quick,
    Slow,
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

impl Pace {
    /// By how much lower the priority of its threads is: slow work gets a tenth of a core that quick work wants too.
    pub(super) fn niceness(self) -> i32 {
        match self {
            Self::Quick => 0,
            Self::Slow => 10,
        }
    }

    /// Time that a lane without work saves up. It is more than the lanes that always have work are apart, so a client
    /// that uses less than its share is served before them. (Borrowed virtual time: Duda, Cheriton 1999.)
    fn claim(self) -> Duration {
        match self {
            Self::Quick => 2 * SLOW,
            Self::Slow => Duration::from_secs(1),
        }
    }

    /// That of a lane whose slowest work took this time.
    fn of(slowest: Duration) -> Self {
        match slowest > SLOW {
            true => Self::Slow,
            false => Self::Quick,
        }
    }
}

impl<G> Lanes<G> {
    /// For so many workers of each pace, and as many requests with several frames that have begun.
    pub(super) fn new(workers: usize) -> Self {
        Self {
            workers,
            running: [0; 2],
            long: 0,
            max_long: workers,
            now: [Duration::ZERO; 2],
            lanes: HashMap::new(),
            firsts: 0,
        }
    }

    /// Requests at work.
    pub(super) fn running(&self) -> usize {
        self.running.iter().sum()
    }

    /// The lane, to which a request comes. Where no other of its requests waits, it starts no further behind the others
    /// than the claim that it may save up.
    pub(super) fn enter(&mut self, lane: Lane) -> &mut Waiting<G> {
        let waiting = self.lanes.entry(lane).or_default();
        if waiting.requests.is_empty() {
            let pace = waiting.pace();
            let least = self.now[pace as usize].saturating_sub(pace.claim());
            waiting.used = waiting.used.max(least);
            self.firsts += 1;
            waiting.since = self.firsts;
        }
        waiting
    }

    /// Whether such a request need not wait for another one with several frames to end.
    fn has_place(&self, length: Length) -> bool {
        length != Length::Long || self.long < self.max_long
    }

    /// Whether a request of a lane may have a worker.
    pub(super) fn may_begin(&self, waiting: &Waiting<G>, length: Length) -> bool {
        let has_worker = self.running[waiting.pace() as usize] < self.workers;
        has_worker && self.has_place(length)
    }

    /// Whether the first request of a lane may have a worker.
    pub(super) fn is_next(&self, waiting: &Waiting<G>) -> bool {
        let first = waiting.requests.front();
        first.is_some_and(|(length, _)| self.may_begin(waiting, *length))
    }

    /// Whether a waiting lane has a better claim than `claim` to a worker that is given up now.
    pub(super) fn has_better(&mut self, pace: Pace, claim: (usize, Duration)) -> bool {
        self.running[pace as usize] -= 1;
        let mut waiting = self.lanes.values().filter(|w| self.is_next(w));
        let has_better = waiting.any(|w| (w.running, w.used) < claim);
        self.running[pace as usize] += 1;
        has_better
    }

    pub(super) fn next(&mut self) -> Option<(Lane, Length, Pace, G)> {
        let waiting = self.lanes.iter().filter(|(_, w)| self.is_next(w));
        let lane = *waiting.min_by_key(|(_, w)| (w.running, w.used, w.since))?.0;
        let waiting = self.lanes.get_mut(&lane)?;
        let (length, give) = waiting.requests.pop_front()?;
        self.firsts += 1;
        waiting.since = self.firsts;
        let pace = self.serve(lane, length);
        Some((lane, length, pace, give))
    }

    /// Takes a worker for a lane.
    pub(super) fn serve(&mut self, lane: Lane, length: Length) -> Pace {
        self.long += usize::from(length == Length::Long);
        let waiting = self.lanes.entry(lane).or_default();
        let pace = waiting.pace();
        waiting.running += 1;
        self.running[pace as usize] += 1;
        let now = &mut self.now[pace as usize];
        *now = waiting.used.max(*now);
        pace
    }

    /// Takes the worker back that a lane had for this time.
    pub(super) fn release(&mut self, lane: Lane, pace: Pace, time: Duration) {
        self.running[pace as usize] -= 1;
        let waiting = self.lanes.entry(lane).or_default();
        waiting.running -= 1;
        waiting.used += time;
        if !time.is_zero() {
            let before = waiting.pace();
            let slowest = time.max(waiting.slowest.mul_f64(FADING));
            let after = Pace::of(slowest);
            // Lanes of another pace have other times.
            let start = (after != before).then(|| self.now[after as usize]);
            let waiting = self.lanes.entry(lane).or_default();
            waiting.slowest = slowest;
            waiting.used = start.unwrap_or(waiting.used);
        }
    }

    pub(super) fn forget_idle_lanes(&mut self) {
        if self.lanes.len() > MAX_IDLE_LANES {
            let now = self.now;
            let owes = |w: &Waiting<G>| w.used > now[w.pace() as usize];
            self.lanes
                .retain(|_, w| w.running > 0 || !w.requests.is_empty() || owes(w));
        }
    }
}

impl<G> Waiting<G> {
    fn pace(&self) -> Pace {
        Pace::of(self.slowest)
    }
}

impl<G> Default for Waiting<G> {
    fn default() -> Self {
        Self {
            used: Duration::ZERO,
            running: 0,
            requests: VecDeque::new(),
            since: 0,
            slowest: Duration::ZERO,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lane_is_slow_after_slow_work_and_quick_again_after_much_quick_work() {
        let mut lanes = Lanes::<()>::new(1);
        let mut work = |millis| {
            let pace = lanes.serve(Lane(1), Length::Short);
            lanes.release(Lane(1), pace, Duration::from_millis(millis));
            pace
        };
        assert_eq!(work(50), Pace::Quick);
        // Some quick work hides nothing.
        assert!((0..10).all(|_| work(1) == Pace::Slow));
        assert!((0..20).any(|_| work(1) == Pace::Quick));
    }

    /// A request of `lane`, which waits.
    fn ask(lanes: &mut Lanes<u64>, lane: u64) {
        let waiting = lanes.enter(Lane(lane));
        waiting.requests.push_back((Length::Short, lane));
    }

    /// The lane that is served next. Its work takes a millisecond.
    fn served(lanes: &mut Lanes<u64>) -> u64 {
        let (lane, _, pace, request) = lanes.next().expect("a request waits");
        lanes.release(lane, pace, Duration::from_millis(1));
        request
    }

    #[test]
    fn a_lane_with_one_request_is_not_overtaken_by_those_that_come_after_it() {
        for first in 0..20 {
            let mut lanes = Lanes::new(1);
            ask(&mut lanes, first);
            (20..40).for_each(|lane| ask(&mut lanes, lane));
            assert_eq!(served(&mut lanes), first);
        }
    }

    #[test]
    fn a_client_that_uses_less_than_its_share_is_served_before_those_that_always_have_work() {
        let mut lanes = Lanes::new(1);
        (1..=5).for_each(|lane| ask(&mut lanes, lane));
        for turn in 0..1_000 {
            // A sixth of the requests would be its share.
            if turn % 8 == 7 {
                ask(&mut lanes, 9);
                assert_eq!(served(&mut lanes), 9, "turn {turn}");
            }
            let lane = served(&mut lanes);
            ask(&mut lanes, lane);
        }
    }

    #[test]
    fn a_client_that_was_idle_for_long_goes_first_for_a_moment_only() {
        let mut lanes = Lanes::new(1);
        ask(&mut lanes, 1);
        for _ in 0..1_000 {
            assert_eq!(served(&mut lanes), 1);
            ask(&mut lanes, 1);
        }
        let mut first = 0;
        ask(&mut lanes, 2);
        while served(&mut lanes) == 2 {
            first += 1;
            ask(&mut lanes, 2);
        }
        let claim = Pace::Quick.claim().as_millis();
        assert!((claim - 1..=claim + 1).contains(&first), "{first}");
    }
}
