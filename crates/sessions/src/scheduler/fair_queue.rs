//! Who gets the next free worker: the client that has one least, and among those the one that used least time.
//!
//! This is start-time fair queueing (Goyal, Vin, Cheng 1996) with measured instead of announced lengths: a client's
//! requests wait in a flow of their own, in order of arrival, and each flow counts the processor time of its work. A flow
//! that had no work saves up a small claim, so a client that sends less than its share hardly waits for those that send
//! all they can.
//!
//! Clients whose work is slow have workers of their own ([`SizeClass`]), so that the frames of the others need not wait until a
//! slow one is done.
//!
//! Work on several frames gives its worker up between two of them when another flow has the better claim. Its thread
//! waits meanwhile, so there are more threads than workers, and only as much such work is begun as there are workers.

use super::cpu_time::thread_cpu_time;
use super::flows::{Flow, Flows, Job, SizeClass};
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::oneshot;

/// Starts a request's work, or gives the turn back where its client has gone.
type Give = Box<dyn FnOnce(WorkerSlot) -> Result<(), WorkerSlot> + Send>;

/// The queue. Clones are the same one.
#[derive(Clone)]
pub(super) struct FairQueue(Arc<Mutex<Flows<Give>>>);

/// A worker, given back when this is dropped.
#[derive(Debug)]
pub struct WorkerSlot {
    /// None once the worker was handed on.
    queue: Option<FairQueue>,
    flow: Flow,
    length: Job,
    pace: SizeClass,
    /// Processor time of the worker's thread when work began, if it has.
    began: Option<Duration>,
}

impl FairQueue {
    /// For so many workers.
    pub(super) fn new(workers: usize) -> Self {
        Self(Arc::new(Mutex::new(Flows::new(workers))))
    }

    /// Calls `give` once there is a worker: now, or on the thread that gives its worker up.
    pub(super) fn enter(&self, flow: Flow, length: Job, give: Give) {
        let pace = {
            let mut state = self.lock();
            state.forget_idle_flows();
            state.enter(flow);
            if !state.may_begin(&state.flows[&flow], length) {
                return state.enter(flow).requests.push_back((length, give));
            }
            state.serve(flow, length)
        };
        // What is given back is handed on as it is dropped.
        drop(give(self.turn(flow, length, pace)));
    }

    /// Asks for a worker; what is returned gets it.
    #[cfg(test)]
    pub(super) fn ask(&self, flow: Flow, length: Job) -> oneshot::Receiver<WorkerSlot> {
        let (give, given) = oneshot::channel();
        self.enter(flow, length, Box::new(|turn| give.send(turn)));
        given
    }

    /// Workers that have work.
    pub(super) fn running(&self) -> usize {
        self.lock().running()
    }

    /// Gives the worker of `flow` to a flow with a better claim, if there is one. Returns what gets a worker again.
    fn yield_to_others(
        &self,
        flow: Flow,
        pace: SizeClass,
        time: Duration,
    ) -> Option<oneshot::Receiver<WorkerSlot>> {
        let given = {
            let mut state = self.lock();
            let own = state.flows.get(&flow)?;
            let claim = (own.running - 1, own.used + time);
            if !state.has_better(pace, claim) {
                return None;
            }
            let (give, given) = oneshot::channel();
            let own = state.flows.get_mut(&flow)?;
            let give: Give = Box::new(|turn| give.send(turn));
            own.requests.push_front((Job::ResumedBatch, give));
            given
        };
        self.hand_on(flow, pace, time, false);
        Some(given)
    }

    fn turn(&self, flow: Flow, length: Job, pace: SizeClass) -> WorkerSlot {
        WorkerSlot {
            queue: Some(self.clone()),
            flow,
            length,
            pace,
            began: None,
        }
    }

    /// Counts the time that `flow` had a worker for, and gives the workers that are free now to the next requests. `ends`
    /// says whether work on several frames has ended.
    fn hand_on(&self, flow: Flow, pace: SizeClass, time: Duration, ends: bool) {
        let mut ended = Some((flow, pace, time, ends));
        loop {
            let (flow, length, pace, give) = {
                let mut state = self.lock();
                if let Some((flow, pace, time, ends)) = ended.take() {
                    state.long -= usize::from(ends);
                    state.release(flow, pace, time);
                }
                match state.next() {
                    Some(next) => next,
                    None => return,
                }
            };
            if let Err(mut refused) = give(self.turn(flow, length, pace)) {
                // Its client has gone. The worker is still to be given away.
                refused.queue = None;
                ended = Some((flow, pace, Duration::ZERO, length != Job::Single));
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Flows<Give>> {
        // Nothing panics while it is held.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for FairQueue {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "FairQueue({} at work)", self.running())
    }
}

impl WorkerSlot {
    /// Which workers' turn it is.
    pub(super) fn pace(&self) -> SizeClass {
        self.pace
    }

    /// Work begins on this thread.
    pub(super) fn begin(&mut self) {
        self.began = Some(thread_cpu_time());
    }

    /// Processor time that the work took.
    fn cpu_time(&self) -> Duration {
        let began = self.began.unwrap_or_else(thread_cpu_time);
        thread_cpu_time().saturating_sub(began)
    }

    /// Lets a request of another flow go first, where that has the better claim. Blocks this thread until there is a
    /// worker again; it must not be one that runs tasks.
    pub(super) fn yield_to_others(&mut self) {
        // Work on one frame ends sooner than it would come back.
        let (Some(queue), Job::Batch | Job::ResumedBatch) = (self.queue.clone(), self.length)
        else {
            return;
        };
        let Some(given) = queue.yield_to_others(self.flow, self.pace, self.cpu_time()) else {
            return;
        };
        // Its worker was handed on.
        self.queue = None;
        let turn = given.blocking_recv();
        *self = turn.expect("every flow with requests is served in the end");
        self.begin();
    }
}

impl Drop for WorkerSlot {
    fn drop(&mut self) {
        if let Some(queue) = self.queue.take() {
            let ends = self.length != Job::Single;
            queue.hand_on(self.flow, self.pace, self.cpu_time(), ends);
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
        let queue = FairQueue::new(1);
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
        let queue = FairQueue::new(1);
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
        assert_eq!((queue.running(), queue.lock().long), (0, 0));
    }

    #[test]
    fn work_on_one_frame_keeps_its_worker() {
        let queue = FairQueue::new(1);
        let mut short = given(&mut queue.ask(Flow(1), Job::Single));
        let mut other = queue.ask(Flow(2), Job::Batch);
        // It would wait for ever for the other, which ends on this thread.
        short.yield_to_others();
        drop(short);
        drop(given(&mut other));
        assert_eq!((queue.running(), queue.lock().long), (0, 0));
    }

    #[test]
    fn quick_work_never_waits_behind_slow_work() {
        let queue = FairQueue::new(1);
        let mut first = given(&mut queue.ask(Flow(1), Job::Single));
        // It took as long as a large picture takes.
        first.queue = None;
        queue.hand_on(Flow(1), SizeClass::Small, Duration::from_millis(50), false);
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
        let queue = FairQueue::new(1);
        let turn = given(&mut queue.ask(Flow(1), Job::Single));
        drop(queue.ask(Flow(2), Job::Single));
        drop(turn);
        assert_eq!(queue.running(), 0);
        drop(given(&mut queue.ask(Flow(2), Job::Single)));
        assert_eq!(queue.running(), 0);
    }
}
