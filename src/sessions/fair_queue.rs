//! Who gets the next free worker: the client that has one least, and among those the one that used least time.
//!
//! This is start-time fair queueing (Goyal, Vin, Cheng 1996) with measured instead of announced lengths: a client's
//! requests wait in a lane of their own, in order of arrival, and each lane counts the time that its work took. A lane
//! that was empty starts at the time of the lane served last, so that waiting saves up no claims.
//!
//! Work on many frames gives its worker up between two of them when another lane has the better claim. Its thread waits
//! meanwhile, so there are more threads than workers.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::oneshot;

/// Lanes above which those without work and without debt are forgotten.
const MAX_IDLE_LANES: usize = 1024;

/// Whose requests wait for each other only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Lane(pub u64);

/// The queue. Clones are the same one.
#[derive(Debug, Clone)]
pub(super) struct FairQueue(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    free: usize,
    /// Requests that gave their worker up between two frames, and how many may.
    stepped_back: usize,
    max_stepped_back: usize,
    /// Time used by the lane that was served last, when it was served.
    now: Duration,
    lanes: HashMap<Lane, Waiting>,
}

#[derive(Debug, Default)]
struct Waiting {
    used: Duration,
    running: usize,
    requests: VecDeque<oneshot::Sender<Turn>>,
}

/// A worker, given back when this is dropped.
#[derive(Debug)]
pub struct Turn {
    /// None once the worker was handed on.
    queue: Option<FairQueue>,
    lane: Lane,
    started: Instant,
}

impl FairQueue {
    /// For so many workers.
    pub(super) fn new(workers: usize) -> Self {
        Self(Arc::new(Mutex::new(State {
            free: workers,
            stepped_back: 0,
            max_stepped_back: workers,
            now: Duration::ZERO,
            lanes: HashMap::new(),
        })))
    }

    /// Waits for a worker. Dropping the future gives up the place.
    pub(super) async fn acquire(&self, lane: Lane) -> Turn {
        let given = {
            let mut state = self.lock();
            state.forget_idle_lanes();
            let now = state.now;
            let waiting = state.lanes.entry(lane).or_default();
            if waiting.requests.is_empty() && waiting.running == 0 {
                waiting.used = waiting.used.max(now);
            }
            if state.free > 0 {
                state.free -= 1;
                state.serve(lane);
                return self.turn(lane);
            }
            let (give, given) = oneshot::channel();
            let waiting = state.lanes.entry(lane).or_default();
            waiting.requests.push_back(give);
            given
        };
        given
            .await
            .expect("every lane with requests is served in the end")
    }

    /// Workers that are free.
    pub(super) fn free(&self) -> usize {
        self.lock().free
    }

    /// Gives the worker of `lane` to a lane with a better claim, if there is one. Returns what gets a worker again.
    fn step_back(&self, lane: Lane, time: Duration) -> Option<oneshot::Receiver<Turn>> {
        let given = {
            let mut state = self.lock();
            let own = state.lanes.get(&lane)?;
            let claim = (own.running - 1, own.used + time);
            let mut waiting = state.lanes.values().filter(|w| !w.requests.is_empty());
            let has_better = waiting.any(|w| (w.running, w.used) < claim);
            if !has_better || state.stepped_back >= state.max_stepped_back {
                return None;
            }
            state.stepped_back += 1;
            let (give, given) = oneshot::channel();
            state.lanes.get_mut(&lane)?.requests.push_front(give);
            given
        };
        self.hand_on(lane, time);
        Some(given)
    }

    fn turn(&self, lane: Lane) -> Turn {
        Turn {
            queue: Some(self.clone()),
            lane,
            started: Instant::now(),
        }
    }

    /// Counts the time that `lane` had a worker for, and gives that worker to the next request.
    fn hand_on(&self, lane: Lane, time: Duration) {
        let mut ended = Some((lane, time));
        loop {
            let (lane, give) = {
                let mut state = self.lock();
                if let Some((lane, time)) = ended.take() {
                    let waiting = state.lanes.entry(lane).or_default();
                    waiting.used += time;
                    waiting.running -= 1;
                }
                match state.next() {
                    Some(next) => next,
                    None => {
                        state.free += 1;
                        return;
                    }
                }
            };
            let Err(mut refused) = give.send(self.turn(lane)) else {
                return;
            };
            // Its client has gone. The worker is still to be given away.
            refused.queue = None;
            ended = Some((lane, Duration::ZERO));
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it is held.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn next(&mut self) -> Option<(Lane, oneshot::Sender<Turn>)> {
        let waiting = self.lanes.iter().filter(|(_, w)| !w.requests.is_empty());
        let lane = *waiting.min_by_key(|(_, w)| (w.running, w.used))?.0;
        let give = self.lanes.get_mut(&lane)?.requests.pop_front()?;
        self.serve(lane);
        Some((lane, give))
    }

    fn serve(&mut self, lane: Lane) {
        let waiting = self.lanes.entry(lane).or_default();
        waiting.running += 1;
        self.now = self.now.max(waiting.used);
    }

    fn forget_idle_lanes(&mut self) {
        if self.lanes.len() > MAX_IDLE_LANES {
            let now = self.now;
            self.lanes
                .retain(|_, w| w.running > 0 || !w.requests.is_empty() || w.used > now);
        }
    }
}

impl Turn {
    /// Lets a request of another lane go first, where that has the better claim. Blocks this thread until there is a
    /// worker again; it must not be one that runs tasks.
    pub(super) fn step_back(&mut self) {
        let Some(queue) = self.queue.clone() else {
            return;
        };
        let Some(given) = queue.step_back(self.lane, self.started.elapsed()) else {
            return;
        };
        // Its worker was handed on.
        self.queue = None;
        let turn = given.blocking_recv();
        queue.lock().stepped_back -= 1;
        *self = turn.expect("every lane with requests is served in the end");
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        if let Some(queue) = self.queue.take() {
            queue.hand_on(self.lane, self.started.elapsed());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_client_with_one_request_does_not_wait_behind_all_of_another() {
        let queue = FairQueue::new(1);
        let first = queue.acquire(Lane(1)).await;
        let (done, mut order) = tokio::sync::mpsc::unbounded_channel();
        let ask = |lane: u64| {
            let (queue, done) = (queue.clone(), done.clone());
            tokio::spawn(async move {
                let turn = queue.acquire(Lane(lane)).await;
                done.send(lane).unwrap();
                drop(turn);
            })
        };
        let mut asked: Vec<_> = (0..20).map(|_| ask(1)).collect();
        asked.push(ask(2));
        while queue
            .lock()
            .lanes
            .values()
            .map(|w| w.requests.len())
            .sum::<usize>()
            < 21
        {
            tokio::task::yield_now().await;
        }
        drop(first);
        let mut served = Vec::new();
        for task in asked {
            task.await.unwrap();
            served.push(order.recv().await.unwrap());
        }
        assert_eq!(served[0], 2, "{served:?}");
        assert_eq!(queue.free(), 1);
    }

    #[tokio::test]
    async fn work_on_many_frames_lets_others_go_between_two_of_them() {
        let queue = FairQueue::new(1);
        let mut long = queue.acquire(Lane(1)).await;
        // Nobody waits.
        long.step_back();
        assert_eq!(queue.free(), 0);
        let (done, order) = std::sync::mpsc::channel();
        let short = tokio::spawn({
            let (queue, done) = (queue.clone(), done.clone());
            async move {
                let turn = queue.acquire(Lane(2)).await;
                done.send("short").unwrap();
                drop(turn);
            }
        });
        while !queue.lock().lanes.contains_key(&Lane(2)) {
            tokio::task::yield_now().await;
        }
        let frames = tokio::task::spawn_blocking(move || {
            long.step_back();
            done.send("long").unwrap();
        });
        short.await.unwrap();
        frames.await.unwrap();
        assert_eq!(order.iter().collect::<Vec<_>>(), ["short", "long"]);
        assert_eq!((queue.free(), queue.lock().stepped_back), (1, 0));
    }

    #[tokio::test]
    async fn requests_whose_clients_have_gone_lose_no_worker() {
        let queue = FairQueue::new(1);
        let turn = queue.acquire(Lane(1)).await;
        let gone = tokio::spawn({
            let queue = queue.clone();
            async move { queue.acquire(Lane(2)).await }
        });
        while !queue.lock().lanes.contains_key(&Lane(2)) {
            tokio::task::yield_now().await;
        }
        gone.abort();
        assert!(gone.await.unwrap_err().is_cancelled());
        drop(turn);
        assert_eq!(queue.free(), 1);
        drop(queue.acquire(Lane(2)).await);
        assert_eq!(queue.free(), 1);
    }
}
