//! The requests that wait, in a flow for each client, and which of them is next.

use std::collections::{HashMap, VecDeque};
use std::time::Duration;

/// Work that takes more processor time without a break makes its flow a slow one. It is some ten times what a frame of a
/// camera takes, and half of the time between two of them.
const SLOW: Duration = Duration::from_millis(15);
/// By how much the memory of the slowest work fades with each other work. A client that hides its slow work among quick
/// work needs a dozen requests of that for each.
const FADING: f64 = 0.9;
/// Flows above which those without work and without debt are forgotten.
const MAX_IDLE_LANES: usize = 1024;

/// Whose requests wait for each other only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Flow(pub u64);

/// All flows. `G` is what gives a request its worker.
#[derive(Debug)]
pub(super) struct Flows<G> {
    /// Workers of each pace.
    workers: usize,
    /// Those at work, by their pace.
    running: [usize; 2],
    /// Requests with several frames that have begun and not ended, and how many may.
    pub(super) long: usize,
    max_long: usize,
    /// The virtual time: the greatest that a flow of each pace had used when it was served.
    now: [Duration; 2],
    pub(super) flows: HashMap<Flow, Waiting<G>>,
    /// How often a request became the first of its flow.
    firsts: u64,
}

/// A flow.
#[derive(Debug)]
pub(super) struct Waiting<G> {
    pub(super) used: Duration,
    pub(super) running: usize,
    pub(super) requests: VecDeque<(Job, G)>,
    /// Orders flows that have used the same time: those that start level are many.
    since: u64,
    /// The longest time that a worker was held lately.
    slowest: Duration,
}

/// Which workers a flow has. Small work has workers of its own, so it never waits until slow work is done; the threads of
/// slow work have a lower priority. (Size-interval task assignment, with the past as the guess of the size.)
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SizeClass {
    Small,
    Large,
}

/// How much work a request is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Job {
    /// One frame, or less.
    Single,
    /// Several frames.
    Batch,
    /// Several frames, some of which are done.
    ResumedBatch,
}

impl SizeClass {
    /// By how much lower the priority of its threads is: slow work gets a tenth of a core that quick work wants too.
    pub(super) fn niceness(self) -> i32 {
        match self {
            Self::Small => 0,
            Self::Large => 10,
        }
    }

    /// Time that a flow without work saves up. It is more than the flows that always have work are apart, so a client
    /// that uses less than its share is served before them. (Borrowed virtual time: Duda, Cheriton 1999.)
    fn claim(self) -> Duration {
        match self {
            Self::Small => 2 * SLOW,
            Self::Large => Duration::from_secs(1),
        }
    }

    /// That of a flow whose slowest work took this time.
    fn of(slowest: Duration) -> Self {
        match slowest > SLOW {
            true => Self::Large,
            false => Self::Small,
        }
    }
}

impl<G> Flows<G> {
    /// For so many workers of each pace, and as many requests with several frames that have begun.
    pub(super) fn new(workers: usize) -> Self {
        Self {
            workers,
            running: [0; 2],
            long: 0,
            max_long: workers,
            now: [Duration::ZERO; 2],
            flows: HashMap::new(),
            firsts: 0,
        }
    }

    /// Requests at work.
    pub(super) fn running(&self) -> usize {
        self.running.iter().sum()
    }

    /// The flow, to which a request comes. Where no other of its requests waits, it starts no further behind the others
    /// than the claim that it may save up.
    pub(super) fn enter(&mut self, flow: Flow) -> &mut Waiting<G> {
        let waiting = self.flows.entry(flow).or_default();
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
    fn has_place(&self, length: Job) -> bool {
        length != Job::Batch || self.long < self.max_long
    }

    /// Whether a request of a flow may have a worker.
    pub(super) fn may_begin(&self, waiting: &Waiting<G>, length: Job) -> bool {
        let has_worker = self.running[waiting.pace() as usize] < self.workers;
        has_worker && self.has_place(length)
    }

    /// Whether the first request of a flow may have a worker.
    pub(super) fn is_next(&self, waiting: &Waiting<G>) -> bool {
        let first = waiting.requests.front();
        first.is_some_and(|(length, _)| self.may_begin(waiting, *length))
    }

    /// Whether a waiting flow has a better claim than `claim` to a worker that is given up now.
    pub(super) fn has_better(&mut self, pace: SizeClass, claim: (usize, Duration)) -> bool {
        self.running[pace as usize] -= 1;
        let mut waiting = self.flows.values().filter(|w| self.is_next(w));
        let has_better = waiting.any(|w| (w.running, w.used) < claim);
        self.running[pace as usize] += 1;
        has_better
    }

    pub(super) fn next(&mut self) -> Option<(Flow, Job, SizeClass, G)> {
        let waiting = self.flows.iter().filter(|(_, w)| self.is_next(w));
        let flow = *waiting.min_by_key(|(_, w)| (w.running, w.used, w.since))?.0;
        let waiting = self.flows.get_mut(&flow)?;
        let (length, give) = waiting.requests.pop_front()?;
        self.firsts += 1;
        waiting.since = self.firsts;
        let pace = self.serve(flow, length);
        Some((flow, length, pace, give))
    }

    /// Takes a worker for a flow.
    pub(super) fn serve(&mut self, flow: Flow, length: Job) -> SizeClass {
        self.long += usize::from(length == Job::Batch);
        let waiting = self.flows.entry(flow).or_default();
        let pace = waiting.pace();
        waiting.running += 1;
        self.running[pace as usize] += 1;
        let now = &mut self.now[pace as usize];
        *now = waiting.used.max(*now);
        pace
    }

    /// Takes the worker back that a flow had for this time.
    pub(super) fn release(&mut self, flow: Flow, pace: SizeClass, time: Duration) {
        self.running[pace as usize] -= 1;
        let waiting = self.flows.entry(flow).or_default();
        waiting.running -= 1;
        waiting.used += time;
        if !time.is_zero() {
            let before = waiting.pace();
            let slowest = time.max(waiting.slowest.mul_f64(FADING));
            let after = SizeClass::of(slowest);
            // Flows of another pace have other times.
            let start = (after != before).then(|| self.now[after as usize]);
            let waiting = self.flows.entry(flow).or_default();
            waiting.slowest = slowest;
            waiting.used = start.unwrap_or(waiting.used);
        }
    }

    pub(super) fn forget_idle_flows(&mut self) {
        if self.flows.len() > MAX_IDLE_LANES {
            let now = self.now;
            let owes = |w: &Waiting<G>| w.used > now[w.pace() as usize];
            self.flows
                .retain(|_, w| w.running > 0 || !w.requests.is_empty() || owes(w));
        }
    }
}

impl<G> Waiting<G> {
    fn pace(&self) -> SizeClass {
        SizeClass::of(self.slowest)
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
        let mut flows = Flows::<()>::new(1);
        let mut work = |millis| {
            let pace = flows.serve(Flow(1), Job::Single);
            flows.release(Flow(1), pace, Duration::from_millis(millis));
            pace
        };
        assert_eq!(work(50), SizeClass::Small);
        // Some quick work hides nothing.
        assert!((0..10).all(|_| work(1) == SizeClass::Large));
        assert!((0..20).any(|_| work(1) == SizeClass::Small));
    }

    /// A request of `flow`, which waits.
    fn ask(flows: &mut Flows<u64>, flow: u64) {
        let waiting = flows.enter(Flow(flow));
        waiting.requests.push_back((Job::Single, flow));
    }

    /// The flow that is served next. Its work takes a millisecond.
    fn served(flows: &mut Flows<u64>) -> u64 {
        let (flow, _, pace, request) = flows.next().expect("a request waits");
        flows.release(flow, pace, Duration::from_millis(1));
        request
    }

    #[test]
    fn a_lane_with_one_request_is_not_overtaken_by_those_that_come_after_it() {
        for first in 0..20 {
            let mut flows = Flows::new(1);
            ask(&mut flows, first);
            (20..40).for_each(|flow| ask(&mut flows, flow));
            assert_eq!(served(&mut flows), first);
        }
    }

    #[test]
    fn a_client_that_uses_less_than_its_share_is_served_before_those_that_always_have_work() {
        let mut flows = Flows::new(1);
        (1..=5).for_each(|flow| ask(&mut flows, flow));
        for turn in 0..1_000 {
            // A sixth of the requests would be its share.
            if turn % 8 == 7 {
                ask(&mut flows, 9);
                assert_eq!(served(&mut flows), 9, "turn {turn}");
            }
            let flow = served(&mut flows);
            ask(&mut flows, flow);
        }
    }

    #[test]
    fn a_client_that_was_idle_for_long_goes_first_for_a_moment_only() {
        let mut flows = Flows::new(1);
        ask(&mut flows, 1);
        for _ in 0..1_000 {
            assert_eq!(served(&mut flows), 1);
            ask(&mut flows, 1);
        }
        let mut first = 0;
        ask(&mut flows, 2);
        while served(&mut flows) == 2 {
            first += 1;
            ask(&mut flows, 2);
        }
        let claim = SizeClass::Small.claim().as_millis();
        assert!((claim - 1..=claim + 1).contains(&first), "{first}");
    }
}
