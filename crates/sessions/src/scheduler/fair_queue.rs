//! Who gets the next free worker: the client with the fewest workers, and among those the one that used the least time.
//!
//! This is start-time fair queueing (Goyal, Vin, Cheng 1996) with measured instead of announced lengths: a client's
//! requests wait in a flow of their own, in order of arrival (where they wait too long, [the newest goes
//! first](super::controlled_delay)), and each flow counts the processor time of its work. A flow that had no work saves
//! up a small claim, so a client that sends less than its share hardly waits for those that send all they can.
//!
//! Clients whose work is slow have workers of their own ([`SizeClass`]), so that the frames of the others need not wait
//! until a slow one is done. The longest work of a client is remembered for some time. A lower bound of the work's time
//! that is known before it begins counts like a measured one.
//!
//! Work on several frames gives its worker up between two of them when another flow has the better claim. Its thread
//! waits meanwhile, so there are more threads than workers, and the number of such requests that have begun is bounded
//! ([`max_begun`](super::flows::max_begun)).

use super::executor::{AfterWork, CpuClock, Executor};
use super::flows::{Flow, Flows, Held, Job, Next, Request, SizeClass};
use crate::sync::{self, Mutex, lock};
use std::fmt;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::oneshot;

/// Starts a request's work, or gives the turn back where its client has gone.
type Give = Box<dyn FnOnce(WorkerSlot) -> Result<(), WorkerSlot> + Send>;

/// The queue. Clones share it.
#[derive(Clone)]
pub(super) struct FairQueue {
    pub(super) flows: Arc<Mutex<Flows<Give>>>,
    cpu: CpuClock,
    /// What runs the work; `None` in tests that take the workers themselves.
    executor: Option<Executor>,
}

/// What a request asks of the queue.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asked {
    pub(super) flow: Flow,
    pub(super) length: Job,
    /// A lower bound of the processor time of its longest part; zero where none is known.
    pub(super) expected: Duration,
    /// Whether the request may be refused where it waits too long.
    pub(super) may_refuse: bool,
}

/// A worker, given back when this is dropped.
#[derive(Debug)]
pub struct WorkerSlot {
    /// `None` once the worker was given to another request.
    queue: Option<FairQueue>,
    cpu: CpuClock,
    flow: Flow,
    length: Job,
    class: SizeClass,
    /// Processor time of the worker's thread when the work began; `None` before.
    began: Option<Duration>,
    /// Processor time of the thread at the last moment at which others could have had a turn.
    checked: Duration,
    /// The longest time between two such moments.
    longest: Duration,
}

impl FairQueue {
    /// A queue for `workers` workers of each class. `delay` is the target of how long a flow's requests wait; zero
    /// where they may wait for ever.
    pub(super) fn new(workers: usize, delay: Duration) -> Self {
        Self {
            flows: Arc::new(Mutex::new(Flows::new(workers, delay))),
            cpu: CpuClock::Thread,
            executor: None,
        }
    }

    /// The queue before the workers of `executor`.
    pub(super) fn before(self, executor: Executor) -> Self {
        Self {
            cpu: executor.cpu_clock(),
            executor: Some(executor),
            ..self
        }
    }

    /// Calls `give` once there is a worker: at once, or later on the thread that gives its worker up. `give` is dropped
    /// without a call where the request has waited too long.
    pub(super) fn enter(&self, asked: Asked, give: Give) {
        let Asked {
            flow,
            length,
            expected,
            may_refuse,
        } = asked;
        let worker = {
            let mut state = lock(&self.flows);
            state.forget_idle_flows();
            state.enter(flow, expected);
            let since = may_refuse.then(|| state.time());
            let Some(worker) = state.worker_for(&state.flows[&flow], length) else {
                return state.wait(flow, length, give, since);
            };
            // Tells controlled delay that this request has not waited.
            state.order(flow, since);
            state.serve(flow, length, worker);
            worker
        };
        // Where the client has gone, `give` returns the slot; dropping it gives the worker to the next request.
        drop(give(self.turn(flow, length, worker)));
    }

    /// Asks for a worker, which comes through the returned channel.
    #[cfg(test)]
    pub(super) fn ask(&self, flow: Flow, length: Job) -> oneshot::Receiver<WorkerSlot> {
        let (give, given) = oneshot::channel();
        let give = Box::new(|turn| give.send(turn));
        let asked = Asked {
            flow,
            length,
            expected: Duration::ZERO,
            may_refuse: false,
        };
        self.enter(asked, give);
        given
    }

    pub(super) fn running(&self) -> usize {
        lock(&self.flows).running()
    }

    /// Gives the worker of `flow` to a flow with a better claim, if there is one. Returns the channel through which the
    /// work gets a worker again.
    fn yield_to_others(
        &self,
        flow: Flow,
        class: SizeClass,
        held: Held,
    ) -> Option<oneshot::Receiver<WorkerSlot>> {
        let given = {
            let mut state = lock(&self.flows);
            if !state.has_better(flow, class, held.time) {
                return None;
            }
            let (give, given) = oneshot::channel();
            let own = state.flows.get_mut(&flow)?;
            own.requests.push_front(Request {
                length: Job::ResumedBatch(class),
                give: Box::new(|turn| give.send(turn)),
                since: None,
            });
            given
        };
        self.hand_on(flow, class, held);
        Some(given)
    }

    /// Another worker for `flow`, where one is idle.
    fn borrow_idle(&self, flow: Flow) -> Option<WorkerSlot> {
        let class = {
            let mut state = lock(&self.flows);
            let class = state.worker_for(state.flows.get(&flow)?, Job::Single)?;
            state.serve(flow, Job::Single, class);
            class
        };
        Some(self.turn(flow, Job::Single, class))
    }

    fn turn(&self, flow: Flow, length: Job, class: SizeClass) -> WorkerSlot {
        WorkerSlot {
            queue: Some(self.clone()),
            cpu: self.cpu,
            flow,
            length,
            class,
            began: None,
            checked: Duration::ZERO,
            longest: Duration::ZERO,
        }
    }

    /// Takes back the worker that `flow` had, and gives all free workers to the next requests.
    fn hand_on(&self, flow: Flow, class: SizeClass, held: Held) {
        let mut ended = Some((flow, class, held));
        loop {
            let (flow, length, class, give) = {
                let mut state = lock(&self.flows);
                if let Some((flow, class, held)) = ended.take() {
                    state.release(flow, class, held);
                }
                match state.next() {
                    Some(Next::Served(flow, length, class, give)) => (flow, length, class, give),
                    Some(Next::Refused(give)) => {
                        // Dropping `give` wakes up the refused request, for which the lock must be free.
                        drop(state);
                        drop(give);
                        continue;
                    }
                    None => return,
                }
            };
            if let Err(mut refused) = give(self.turn(flow, length, class)) {
                // The request's client has gone. The loop gives the worker away again.
                refused.queue = None;
                let ends = length != Job::Single;
                let held = Held {
                    ends,
                    ..Held::default()
                };
                ended = Some((flow, class, held));
            }
        }
    }
}

impl fmt::Debug for FairQueue {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "FairQueue({} at work)", self.running())
    }
}

impl WorkerSlot {
    pub(super) fn class(&self) -> SizeClass {
        self.class
    }

    /// The clock of the processor time of the work.
    pub(super) fn cpu(&self) -> CpuClock {
        self.cpu
    }

    /// Notes that the request's work begins on this thread.
    pub(super) fn begin(&mut self) {
        let now = self.cpu.now();
        (self.began, self.checked) = (Some(now), now);
    }

    /// The worker's use so far. `ends` says whether work on several frames has ended.
    fn held(&mut self, ends: bool) -> Held {
        let Some(began) = self.began else {
            return Held {
                ends,
                ..Held::default()
            };
        };
        let now = self.cpu.now();
        self.longest = self.longest.max(now.saturating_sub(self.checked));
        self.checked = now;
        Held {
            time: now.saturating_sub(began),
            longest: self.longest,
            ends,
        }
    }

    /// Has an idle worker call `work` for the same request, again and again while it returns true and nobody else wants
    /// a worker. False where no worker is idle, or all work runs on one thread.
    pub(super) fn share(&self, work: impl Fn() -> bool + Send + 'static) -> bool {
        let (Some(queue), CpuClock::Thread) = (&self.queue, self.cpu) else {
            return false;
        };
        let Some(executor) = &queue.executor else {
            return false;
        };
        let Some(mut borrowed) = queue.borrow_idle(self.flow) else {
            return false;
        };
        let work = move || -> AfterWork {
            borrowed.begin();
            while work() && !borrowed.is_wanted() {}
            drop(work);
            Box::new(move || drop(borrowed))
        };
        // On threads with the priority of the request's own, which waits for this work.
        executor.start(self.class, Box::new(work));
        true
    }

    /// Whether another flow has a better claim to the worker, or there is more work than workers.
    fn is_wanted(&mut self) -> bool {
        let time = self.held(false).time;
        self.queue.as_ref().is_some_and(|queue| {
            let mut state = lock(&queue.flows);
            state.is_crowded() || state.has_better(self.flow, self.class, time)
        })
    }

    /// Lets a request of another flow go first, if that flow has the better claim. Blocks this thread until there is a
    /// worker again, so it must not be a thread of the async runtime.
    pub(super) fn yield_to_others(&mut self) {
        // If all work runs on one thread, nobody could give the worker back.
        if self.cpu == CpuClock::Still {
            return;
        }
        // Work on one frame ends sooner than its turn would come again.
        let (Some(queue), Job::Batch | Job::ResumedBatch(_)) = (self.queue.clone(), self.length)
        else {
            return;
        };
        let held = self.held(false);
        let Some(given) = queue.yield_to_others(self.flow, self.class, held) else {
            return;
        };
        // The worker was given away.
        self.queue = None;
        let turn = sync::wait_for(given);
        *self = turn.expect("every flow with requests is served in the end");
        self.begin();
    }
}

impl Drop for WorkerSlot {
    fn drop(&mut self) {
        if let Some(queue) = self.queue.take() {
            let held = self.held(self.length != Job::Single);
            queue.hand_on(self.flow, self.class, held);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn given(asked: &mut oneshot::Receiver<WorkerSlot>) -> WorkerSlot {
        asked.try_recv().expect("a worker is free for it")
    }

    #[test]
    fn a_client_with_one_request_does_not_wait_behind_all_of_another() {
        let queue = FairQueue::new(1, Duration::ZERO);
        let mut first = given(&mut queue.ask(Flow(1), Job::Single));
        first.begin();
        let mut asked: Vec<_> = (0..20).map(|_| queue.ask(Flow(1), Job::Single)).collect();
        let mut other = queue.ask(Flow(2), Job::Single);
        drop(first);
        drop(given(&mut other));
        asked.iter_mut().for_each(|asked| drop(given(asked)));
        assert_eq!(queue.running(), 0);
    }

    #[test]
    fn work_on_many_frames_lets_others_go_between_two_of_them() {
        let queue = FairQueue::new(1, Duration::ZERO);
        let mut long = given(&mut queue.ask(Flow(1), Job::Batch));
        // Nobody waits.
        long.yield_to_others();
        assert_eq!(queue.running(), 1);
        let short = queue.ask(Flow(2), Job::Single);
        let (done, order) = std::sync::mpsc::channel();
        let frames = std::thread::spawn({
            let done = done.clone();
            move || {
                long.begin();
                long.yield_to_others();
                done.send("long").unwrap();
            }
        });
        let short = short.blocking_recv().unwrap();
        done.send("short").unwrap();
        drop((short, done));
        frames.join().unwrap();
        assert_eq!(order.iter().collect::<Vec<_>>(), ["short", "long"]);
        assert_eq!((queue.running(), lock(&queue.flows).begun), (0, 0));
    }

    #[test]
    fn work_on_one_frame_keeps_its_worker() {
        let queue = FairQueue::new(1, Duration::ZERO);
        let mut short = given(&mut queue.ask(Flow(1), Job::Single));
        let mut other = queue.ask(Flow(2), Job::Batch);
        // If this work gave way, it would wait for ever, because the other work ends on this thread.
        short.yield_to_others();
        drop(short);
        drop(given(&mut other));
        assert_eq!((queue.running(), lock(&queue.flows).begun), (0, 0));
    }

    #[test]
    fn quick_work_never_waits_behind_slow_work() {
        let queue = FairQueue::new(1, Duration::ZERO);
        let mut first = given(&mut queue.ask(Flow(1), Job::Single));
        // The work took as long as that of a large picture.
        first.queue = None;
        let long = Duration::from_millis(50);
        let held = Held {
            time: long,
            longest: long,
            ends: false,
        };
        queue.hand_on(Flow(1), SizeClass::Small, held);
        let slow = given(&mut queue.ask(Flow(1), Job::Single));
        // The only worker of quick work is free.
        let quick = given(&mut queue.ask(Flow(2), Job::Single));
        assert_eq!(queue.running(), 2);
        let mut behind = queue.ask(Flow(1), Job::Single);
        assert!(behind.try_recv().is_err());
        drop(quick);
        assert!(behind.try_recv().is_err());
        drop(slow);
        drop(given(&mut behind));
    }

    #[test]
    fn requests_whose_clients_have_gone_lose_no_worker() {
        let queue = FairQueue::new(1, Duration::ZERO);
        let turn = given(&mut queue.ask(Flow(1), Job::Single));
        drop(queue.ask(Flow(2), Job::Single));
        drop(turn);
        assert_eq!(queue.running(), 0);
        drop(given(&mut queue.ask(Flow(2), Job::Single)));
        assert_eq!(queue.running(), 0);
    }
}
