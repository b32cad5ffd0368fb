//! The requests that wait, in a flow for each client, and which of them is next.

use super::controlled_delay::{ControlledDelay, Order};
use crate::clock::{self, Instant};
use std::collections::{HashMap, VecDeque};
use std::time::Duration;

/// Work that takes more processor time than this without a break makes its flow a slow one. It is about half of the
/// time between two frames of a camera, some ten times what a frame takes, and more than what a frame with learning
/// takes in a test build.
const SLOW: Duration = Duration::from_millis(20);
/// The memory of the longest work fades by half in this time, whatever else the client sends meanwhile.
const HALF_LIFE: Duration = Duration::from_secs(5);
/// Where there are more flows than this, those without requests, debt and remembered slow work are forgotten.
const MAX_IDLE_FLOWS: usize = 1024;
/// Least number of requests with several frames that may have begun, whatever the number of workers.
const MIN_BEGUN: usize = if cfg!(feature = "shuttle") { 2 } else { 8 };

/// A client to the scheduler: requests of one flow have their turns together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Flow(pub u64);

/// All flows. `G` is what gives a request its worker.
#[derive(Debug)]
pub(super) struct Flows<G> {
    /// Workers of each class.
    workers: usize,
    /// Workers at work, by their class.
    running: [usize; 2],
    /// Requests with several frames that have begun and not ended.
    pub(super) begun: usize,
    /// The virtual time: the greatest that a flow of each class had used when it was served.
    now: [Duration; 2],
    pub(super) flows: HashMap<Flow, Waiting<G>>,
    /// The target of the delay of a flow's requests; zero where they may wait for ever.
    delay: Duration,
    /// Counts the moments at which a flow got a new first request.
    firsts: u64,
    started: Instant,
    /// Time that a test lets pass.
    #[cfg(test)]
    pub(super) passed: Duration,
}

/// A flow: its use of workers, and the requests that wait.
#[derive(Debug)]
pub(super) struct Waiting<G> {
    pub(super) used: Duration,
    pub(super) running: usize,
    /// How many of the flow's workers are those for small work.
    quick: usize,
    /// Requests with several frames that have begun and not ended.
    begun: usize,
    pub(super) requests: VecDeque<Request<G>>,
    delay: ControlledDelay,
    /// When the flow's first request became the first, by the count of `Flows::firsts`. Orders flows that have used the
    /// same time, as many have that start level.
    since: u64,
    class: SizeClass,
    longest: Faded,
}

/// A request that waits.
#[derive(Debug)]
pub(super) struct Request<G> {
    pub(super) length: Job,
    pub(super) give: G,
    /// When the request came; `None` where it may not be refused.
    pub(super) since: Option<Duration>,
}

/// The outcome for the request whose turn it is.
#[derive(Debug)]
pub(super) enum Next<G> {
    /// The request gets a worker of this class.
    Served(Flow, Job, SizeClass, G),
    /// The request has waited too long.
    Refused(G),
}

/// The longest time that a flow held a worker without a break. The value halves every [`HALF_LIFE`].
#[derive(Debug, Clone, Copy, Default)]
struct Faded {
    value: Duration,
    at: Duration,
}

impl Faded {
    /// The value at `now`.
    fn at(self, now: Duration) -> Duration {
        let half_lives = now.saturating_sub(self.at).div_duration_f64(HALF_LIFE);
        self.value.mul_f64((-half_lives).exp2())
    }
}

/// Which workers a flow has. Small work has workers of its own, so it never waits until slow work is done; the threads
/// of slow work have a lower priority. (Size-interval task assignment, with the past as the guess of the size.)
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SizeClass {
    Small,
    Large,
}

/// How many frames a request has, and whether its work has begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Job {
    /// One frame, or work without a frame.
    Single,
    /// Several frames.
    Batch,
    /// Several frames, some of which are done, on a thread of this class.
    ResumedBatch(SizeClass),
}

/// How good a flow's claim to a worker is, the least being the best: whether the worker would be borrowed from the
/// other class, how many workers the flow has, and the time that it has used.
pub(super) type Claim = (bool, usize, Duration);

impl SizeClass {
    /// The niceness of its threads. At 10, slow work gets about a tenth of a core that quick work wants too.
    pub(super) fn niceness(self) -> i32 {
        match self {
            Self::Small => 0,
            Self::Large => 10,
        }
    }

    /// Time that a flow without work saves up: as much as the flows that always have work are apart, so a client that
    /// uses less than its share is served before them, and hardly waits for others that come back too. (Borrowed
    /// virtual time: Duda, Cheriton 1999.)
    fn claim(self) -> Duration {
        match self {
            Self::Small => SLOW,
            Self::Large => Duration::from_secs(1),
        }
    }

    /// The class of a flow whose longest work took this time.
    fn of(longest: Duration) -> Self {
        match longest > SLOW {
            true => Self::Large,
            false => Self::Small,
        }
    }
}

/// Most requests with several frames that have begun and not ended. Each needs a thread, which waits between two frames
/// while others have the worker.
pub(super) fn max_begun(workers: usize) -> usize {
    MIN_BEGUN.max(2 * workers)
}

impl<G> Flows<G> {
    /// No flows yet, for `workers` workers of each class and this target of the delay.
    pub(super) fn new(workers: usize, delay: Duration) -> Self {
        Self {
            workers,
            delay,
            running: [0; 2],
            begun: 0,
            now: [Duration::ZERO; 2],
            flows: HashMap::new(),
            firsts: 0,
            started: clock::now(),
            #[cfg(test)]
            passed: Duration::ZERO,
        }
    }

    pub(super) fn running(&self) -> usize {
        self.running.iter().sum()
    }

    pub(super) fn time(&self) -> Duration {
        // Where a test chooses the order of threads, time passes only by `passed`.
        let elapsed = match cfg!(feature = "shuttle") {
            true => Duration::ZERO,
            false => self.started.elapsed(),
        };
        #[cfg(test)]
        return elapsed + self.passed;
        #[cfg(not(test))]
        elapsed
    }

    /// The flow, to which a request comes whose work takes at least `expected`. Where none of its requests waits, its
    /// used time is raised to the virtual time less the claim that a flow may save up.
    pub(super) fn enter(&mut self, flow: Flow, expected: Duration) -> &mut Waiting<G> {
        self.note(flow, expected);
        let waiting = self.flows.entry(flow).or_default();
        if waiting.requests.is_empty() {
            let class = waiting.class;
            let least = self.now[class as usize].saturating_sub(class.claim());
            waiting.used = waiting.used.max(least);
            self.firsts += 1;
            waiting.since = self.firsts;
        }
        waiting
    }

    /// Adds a request to those that wait. `since` is now, or `None` where the request may not be refused.
    pub(super) fn wait(&mut self, flow: Flow, length: Job, give: G, since: Option<Duration>) {
        let request = Request {
            length,
            give,
            since,
        };
        let waiting = self.flows.entry(flow).or_default();
        waiting.requests.push_back(request);
    }

    /// Which request of a flow is next. `since` is when the oldest came, where it may be refused. The target of a flow
    /// with slow work is at least as long as that work.
    pub(super) fn order(&mut self, flow: Flow, since: Option<Duration>) -> Order {
        let now = self.time();
        let waiting = self.flows.get_mut(&flow);
        let (Some(since), Some(waiting), false) = (since, waiting, self.delay.is_zero()) else {
            return Order::Oldest;
        };
        let target = self.delay.max(waiting.longest.at(now));
        let waited = now.saturating_sub(since);
        let is_alone = waiting.requests.len() <= 1;
        waiting.delay.order((waited, is_alone), now, target)
    }

    /// Notes work of a flow that took, or will take, this time without a break. Each class has a virtual time of its
    /// own, so a flow that changes its class starts level with that of its new class.
    fn note(&mut self, flow: Flow, longest: Duration) {
        let at = self.time();
        let waiting = self.flows.entry(flow).or_default();
        let value = waiting.longest.at(at).max(longest);
        waiting.longest = Faded { value, at };
        let class = SizeClass::of(value);
        if class != waiting.class {
            waiting.class = class;
            waiting.used = self.now[class as usize];
        }
    }

    /// Whether a request of this length may begin. Only one with several frames may have to wait until another such
    /// ends. A flow that has begun none may begin one as long as there are threads; a further one only while fewer have
    /// begun than there are workers.
    fn has_place(&self, waiting: &Waiting<G>, length: Job) -> bool {
        let is_first = waiting.begun == 0 && self.begun < max_begun(self.workers);
        length != Job::Batch || is_first || self.begun < self.workers
    }

    /// Which worker a request of a flow may have now. A flow has at most one worker for small work, so that no client
    /// takes all of these with work that turns out to be slow. Its other requests borrow workers for large work while
    /// fewer work in all than there are workers of one class.
    pub(super) fn worker_for(&self, waiting: &Waiting<G>, length: Job) -> Option<SizeClass> {
        let [small, large] = self.running.map(|running| running < self.workers);
        let small = small && waiting.quick == 0;
        let worker = match (length, waiting.class) {
            (Job::ResumedBatch(SizeClass::Small), _) => small.then_some(SizeClass::Small),
            (Job::ResumedBatch(SizeClass::Large), _) => large.then_some(SizeClass::Large),
            (_, SizeClass::Small) if small => Some(SizeClass::Small),
            (_, SizeClass::Small) if waiting.quick == 0 || self.running() >= self.workers => None,
            (_, SizeClass::Small | SizeClass::Large) => large.then_some(SizeClass::Large),
        };
        worker.filter(|_| self.has_place(waiting, length))
    }

    /// The claim of the first request of a flow, where it may have a worker.
    fn claim(&self, waiting: &Waiting<G>) -> Option<Claim> {
        let length = waiting.requests.front()?.length;
        let worker = self.worker_for(waiting, length)?;
        Some((worker != waiting.class, waiting.running, waiting.used))
    }

    /// Whether more workers of both classes together are at work than there are of one class.
    pub(super) fn is_crowded(&self) -> bool {
        self.running() > self.workers
    }

    /// Whether a waiting flow has a better claim than this one to the worker that it has had for this time.
    pub(super) fn has_better(&mut self, flow: Flow, class: SizeClass, time: Duration) -> bool {
        let Some(own) = self.flows.get(&flow) else {
            return false;
        };
        let claim = (class != own.class, own.running - 1, own.used + time);
        self.running[class as usize] -= 1;
        let others = self.flows.iter().filter(|(other, _)| **other != flow);
        let mut claims = others.filter_map(|(_, waiting)| self.claim(waiting));
        let has_better = claims.any(|other| other < claim);
        self.running[class as usize] += 1;
        has_better
    }

    /// The request with the best claim; none where no request may have a worker.
    pub(super) fn next(&mut self) -> Option<Next<G>> {
        let claims = self.flows.iter().filter_map(|(flow, waiting)| {
            let claim = self.claim(waiting)?;
            Some(((claim, waiting.since), *flow))
        });
        let (_, flow) = claims.min_by_key(|(claim, _)| *claim)?;
        let waiting = &self.flows[&flow];
        let oldest = waiting.requests.front()?;
        let worker = self.worker_for(waiting, oldest.length)?;
        let order = self.order(flow, oldest.since);
        let requests = &mut self.flows.get_mut(&flow)?.requests;
        let is_newest = order == Order::Newest && requests.back()?.since.is_some();
        let request = match is_newest {
            true => requests.pop_back(),
            false => requests.pop_front(),
        };
        let Request { length, give, .. } = request?;
        if order == Order::Refuse {
            return Some(Next::Refused(give));
        }
        self.firsts += 1;
        self.flows.get_mut(&flow)?.since = self.firsts;
        self.serve(flow, length, worker);
        Some(Next::Served(flow, length, worker, give))
    }

    /// Takes a worker for a flow.
    pub(super) fn serve(&mut self, flow: Flow, length: Job, worker: SizeClass) {
        let begins = usize::from(length == Job::Batch);
        self.begun += begins;
        self.running[worker as usize] += 1;
        let waiting = self.flows.entry(flow).or_default();
        waiting.begun += begins;
        waiting.running += 1;
        waiting.quick += usize::from(worker == SizeClass::Small);
        let now = &mut self.now[waiting.class as usize];
        *now = waiting.used.max(*now);
    }

    /// Takes the worker back that a flow had.
    pub(super) fn release(&mut self, flow: Flow, worker: SizeClass, held: Held) {
        let ends = usize::from(held.ends);
        self.begun -= ends;
        self.running[worker as usize] -= 1;
        let waiting = self.flows.entry(flow).or_default();
        waiting.begun -= ends;
        waiting.running -= 1;
        waiting.quick -= usize::from(worker == SizeClass::Small);
        waiting.used += held.time;
        self.note(flow, held.longest);
    }

    pub(super) fn forget_idle_flows(&mut self) {
        if self.flows.len() > MAX_IDLE_FLOWS {
            let (now, at) = (self.now, self.time());
            self.flows.retain(|_, waiting| {
                let owes = waiting.used > now[waiting.class as usize];
                let is_slow = waiting.longest.at(at) > SLOW;
                waiting.running > 0 || !waiting.requests.is_empty() || owes || is_slow
            });
        }
    }
}

/// How a flow used a worker.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Held {
    /// Processor time of its work.
    pub(super) time: Duration,
    /// The longest part of this time in which the work gave nobody else a turn.
    pub(super) longest: Duration,
    /// Whether work on several frames has ended.
    pub(super) ends: bool,
}

impl<G> Default for Waiting<G> {
    fn default() -> Self {
        Self {
            used: Duration::ZERO,
            running: 0,
            quick: 0,
            begun: 0,
            requests: VecDeque::new(),
            delay: ControlledDelay::default(),
            since: 0,
            class: SizeClass::Small,
            longest: Faded::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gives a flow a worker for work on one frame that takes this time.
    fn work<G>(flows: &mut Flows<G>, flow: u64, millis: u64) -> SizeClass {
        let flow = Flow(flow);
        let waiting = flows.enter(flow, Duration::ZERO);
        let class = waiting.class;
        flows.serve(flow, Job::Single, class);
        let time = Duration::from_millis(millis);
        let held = Held {
            time,
            longest: time,
            ends: false,
        };
        flows.release(flow, class, held);
        class
    }

    #[test]
    fn slow_work_is_remembered_in_time_and_no_number_of_quick_works_hides_it() {
        let mut flows = Flows::<()>::new(1, Duration::ZERO);
        assert_eq!(work(&mut flows, 1, 1_000), SizeClass::Small);
        // A flow stays slow however many quick works follow.
        assert!((0..1_000).all(|_| work(&mut flows, 1, 0) == SizeClass::Large));
        flows.passed += 4 * HALF_LIFE;
        assert_eq!(work(&mut flows, 1, 0), SizeClass::Large);
        flows.passed += 2 * HALF_LIFE;
        assert_eq!(work(&mut flows, 1, 0), SizeClass::Small);
    }

    #[test]
    fn a_flow_whose_work_is_announced_as_slow_has_no_quick_worker() {
        let mut flows = Flows::<()>::new(2, Duration::ZERO);
        let expected = Duration::from_millis(100);
        flows.enter(Flow(1), expected);
        let worker = flows.worker_for(&flows.flows[&Flow(1)], Job::Single);
        assert_eq!(worker, Some(SizeClass::Large));
    }

    #[test]
    fn a_flow_has_one_quick_worker_and_borrows_others_while_nobody_wants_them() {
        let mut flows = Flows::<u64>::new(3, Duration::ZERO);
        let mut workers = Vec::new();
        for _ in 0..4 {
            flows.enter(Flow(1), Duration::ZERO);
            let worker = flows.worker_for(&flows.flows[&Flow(1)], Job::Single);
            worker
                .iter()
                .for_each(|worker| flows.serve(Flow(1), Job::Single, *worker));
            workers.push(worker);
        }
        let (quick, borrowed) = (Some(SizeClass::Small), Some(SizeClass::Large));
        assert_eq!(workers, [quick, borrowed, borrowed, None]);
        // Another flow gets a quick worker at once.
        flows.enter(Flow(2), Duration::ZERO);
        let worker = flows.worker_for(&flows.flows[&Flow(2)], Job::Single);
        assert_eq!(worker, quick);
        flows.serve(Flow(2), Job::Single, SizeClass::Small);
        // A borrowed worker that is given back goes first to work of its own class.
        ask(&mut flows, 1);
        flows.enter(Flow(3), Duration::from_secs(1));
        ask(&mut flows, 3);
        flows.release(Flow(1), SizeClass::Large, Held::default());
        assert!(matches!(flows.next(), Some(Next::Served(Flow(3), ..))));
    }

    #[test]
    fn a_flow_without_a_begun_batch_begins_one_beside_those_of_another() {
        let mut flows = Flows::<u64>::new(2, Duration::ZERO);
        let begin = |flows: &mut Flows<u64>, flow| {
            flows.enter(Flow(flow), Duration::ZERO);
            flows.has_place(&flows.flows[&Flow(flow)], Job::Batch)
        };
        for _ in 0..2 {
            assert!(begin(&mut flows, 1));
            // The batch gives its worker up between two frames.
            flows.serve(Flow(1), Job::Batch, SizeClass::Large);
            flows.release(Flow(1), SizeClass::Large, Held::default());
        }
        assert!(!begin(&mut flows, 1), "its places are as many as workers");
        assert!(begin(&mut flows, 2), "another has one of its own");
    }

    #[test]
    fn flows_that_are_idle_are_forgotten_and_those_that_owe_wait_or_are_slow_are_not() {
        let mut flows = Flows::<u64>::new(4, Duration::ZERO);
        let all = MAX_IDLE_FLOWS as u64;
        for flow in 0..all {
            flows.enter(Flow(100 + flow), Duration::ZERO);
        }
        flows.forget_idle_flows();
        assert_eq!(flows.flows.len(), MAX_IDLE_FLOWS, "these are few");
        ask(&mut flows, 1);
        flows.enter(Flow(2), Duration::ZERO);
        flows.serve(Flow(2), Job::Single, SizeClass::Small);
        work(&mut flows, 3, 1_000);
        // Flow 4 has used more than the virtual time.
        work(&mut flows, 4, 15);
        work(&mut flows, 4, 15);
        flows.forget_idle_flows();
        let mut left: Vec<u64> = flows.flows.keys().map(|flow| flow.0).collect();
        left.sort_unstable();
        assert_eq!(left, [1, 2, 3, 4]);
        // A flow that was slow long ago is quick again.
        flows.passed += 60 * HALF_LIFE;
        for flow in 0..all {
            flows.enter(Flow(100 + flow), Duration::ZERO);
        }
        flows.forget_idle_flows();
        assert!(flows.flows.contains_key(&Flow(1)) && flows.flows.contains_key(&Flow(2)));
    }

    #[test]
    fn a_batch_gives_its_worker_to_the_flow_that_used_less_or_has_none_at_work() {
        let mut flows = Flows::<u64>::new(1, Duration::ZERO);
        let class = SizeClass::Small;
        flows.enter(Flow(1), Duration::ZERO);
        flows.serve(Flow(1), Job::Batch, class);
        let has_better = |flows: &mut Flows<u64>, millis| {
            let time = Duration::from_millis(millis);
            let better = flows.has_better(Flow(1), class, time);
            assert_eq!(flows.running(), 1, "the look changes nothing");
            better
        };
        assert!(!has_better(&mut flows, 5), "nobody waits");
        ask(&mut flows, 2);
        assert!(!has_better(&mut flows, 0), "both have used as much");
        assert!(has_better(&mut flows, 1));
        assert!(!flows.has_better(Flow(3), class, Duration::ZERO), "unknown");
    }

    /// A request of `flow`, which waits.
    fn ask(flows: &mut Flows<u64>, flow: u64) {
        flows.enter(Flow(flow), Duration::ZERO);
        let since = Some(flows.time());
        flows.wait(Flow(flow), Job::Single, flow, since);
    }

    /// Serves the next flow with work of a millisecond, and returns that flow.
    fn served(flows: &mut Flows<u64>) -> u64 {
        let Some(Next::Served(flow, _, class, request)) = flows.next() else {
            panic!("a request waits, and none is refused");
        };
        let time = Duration::from_millis(1);
        let held = Held {
            time,
            longest: time,
            ends: false,
        };
        flows.release(flow, class, held);
        request
    }

    #[test]
    fn a_flow_with_one_request_is_not_overtaken_by_those_that_come_after_it() {
        for first in 0..20 {
            let mut flows = Flows::new(1, Duration::ZERO);
            ask(&mut flows, first);
            (20..40).for_each(|flow| ask(&mut flows, flow));
            assert_eq!(served(&mut flows), first);
        }
    }

    #[test]
    fn a_client_that_uses_less_than_its_share_is_served_before_those_that_always_have_work() {
        let mut flows = Flows::new(1, Duration::ZERO);
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
    fn a_flow_with_too_many_requests_answers_the_newest_and_refuses_the_oldest() {
        const TURN: Duration = Duration::from_millis(5);
        let mut flows = Flows::<(u64, u32)>::new(1, Duration::from_millis(75));
        let (mut refused, mut waited) = (Vec::new(), Vec::new());
        for turn in 0..400 {
            flows.passed += TURN;
            // Flow 1 sends twice as many requests as there is time for, flow 2 few.
            let other = (turn % 4 == 0).then_some(2);
            for flow in [1, 1].into_iter().chain(other) {
                flows.enter(Flow(flow), Duration::ZERO);
                let since = Some(flows.time());
                flows.wait(Flow(flow), Job::Single, (flow, turn), since);
            }
            loop {
                match flows.next().expect("requests wait") {
                    Next::Refused(request) => refused.push((request, turn)),
                    Next::Served(flow, _, class, (_, since)) => {
                        flows.release(flow, class, Held::default());
                        waited.push(turn - since);
                        break;
                    }
                }
            }
        }
        assert_eq!(waited.len(), 400, "none for want of time");
        assert!(refused.iter().all(|((flow, _), _)| *flow == 1));
        let (_, first) = refused[0];
        assert!(first >= 100, "a burst of half a second is worked off");
        let waited = &mut waited[200..];
        waited.sort_unstable();
        assert!(waited[100] <= 2 && waited[199] <= 30, "{waited:?}");
    }

    #[test]
    fn a_client_that_was_idle_for_long_goes_first_for_a_moment_only() {
        let mut flows = Flows::new(1, Duration::ZERO);
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
