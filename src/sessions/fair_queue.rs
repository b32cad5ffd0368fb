//! Who gets the next free worker: the client that has one least, and among those the one that used least time.
//!
//! This is start-time fair queueing (Goyal, Vin, Cheng 1996) with measured instead of announced lengths: a client's
//! requests wait in a lane of their own, in order of arrival, and each lane counts the processor time of its work. A lane
//! whose requests begin to wait starts level with the others, so that being idle saves up no claims.
//!
//! Clients whose work is slow have workers of their own ([`Pace`]), so that the frames of the others need not wait until a
//! slow one is done.
//!
//! Work on several frames gives its worker up between two of them when another lane has the better claim. Its thread
//! waits meanwhile, so there are more threads than workers, and only as much such work is begun as there are workers.

use super::cpu_time::thread_cpu_time;
use super::lanes::{Lane, Lanes, Length, Pace};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::oneshot;

/// Gives a request its worker.
type Give = oneshot::Sender<Turn>;

/// The queue. Clones are the same one.
#[derive(Debug, Clone)]
pub(super) struct FairQueue(Arc<Mutex<Lanes<Give>>>);

/// A worker, given back when this is dropped.
#[derive(Debug)]
pub struct Turn {
    /// None once the worker was handed on.
    queue: Option<FairQueue>,
    lane: Lane,
    length: Length,
    pace: Pace,
    /// Processor time of the worker's thread when work began, if it has.
    began: Option<Duration>,
}

impl FairQueue {
    /// For so many workers.
    pub(super) fn new(workers: usize) -> Self {
        Self(Arc::new(Mutex::new(Lanes::new(workers))))
    }

    /// Waits for a worker. Dropping the future gives up the place.
    pub(super) async fn acquire(&self, lane: Lane, length: Length) -> Turn {
        let given = {
            let mut state = self.lock();
            state.forget_idle_lanes();
            state.enter(lane);
            if state.may_begin(&state.lanes[&lane], length) {
                let pace = state.serve(lane, length);
                return self.turn(lane, length, pace);
            }
            let (give, given) = oneshot::channel();
            state.enter(lane).requests.push_back((length, give));
            given
        };
        given
            .await
            .expect("every lane with requests is served in the end")
    }

    /// Workers that have work.
    pub(super) fn running(&self) -> usize {
        self.lock().running()
    }

    /// Gives the worker of `lane` to a lane with a better claim, if there is one. Returns what gets a worker again.
    fn step_back(&self, lane: Lane, pace: Pace, time: Duration) -> Option<oneshot::Receiver<Turn>> {
        let given = {
            let mut state = self.lock();
            let own = state.lanes.get(&lane)?;
            let claim = (own.running - 1, own.used + time);
            if !state.has_better(pace, claim) {
                return None;
            }
            let (give, given) = oneshot::channel();
            let own = state.lanes.get_mut(&lane)?;
            own.requests.push_front((Length::Begun, give));
            given
        };
        self.hand_on(lane, pace, time, false);
        Some(given)
    }

    fn turn(&self, lane: Lane, length: Length, pace: Pace) -> Turn {
        Turn {
            queue: Some(self.clone()),
            lane,
            length,
            pace,
            began: None,
        }
    }

    /// Counts the time that `lane` had a worker for, and gives the workers that are free now to the next requests. `ends`
    /// says whether work on several frames has ended.
    fn hand_on(&self, lane: Lane, pace: Pace, time: Duration, ends: bool) {
        let mut ended = Some((lane, pace, time, ends));
        loop {
            let (lane, length, pace, give) = {
                let mut state = self.lock();
                if let Some((lane, pace, time, ends)) = ended.take() {
                    state.long -= usize::from(ends);
                    state.release(lane, pace, time);
                }
                match state.next() {
                    Some(next) => next,
                    None => return,
                }
            };
            if let Err(mut refused) = give.send(self.turn(lane, length, pace)) {
                // Its client has gone. The worker is still to be given away.
                refused.queue = None;
                ended = Some((lane, pace, Duration::ZERO, length != Length::Short));
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Lanes<Give>> {
        // Nothing panics while it is held.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Turn {
    /// Which workers' turn it is.
    pub(super) fn pace(&self) -> Pace {
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

    /// Lets a request of another lane go first, where that has the better claim. Blocks this thread until there is a
    /// worker again; it must not be one that runs tasks.
    pub(super) fn step_back(&mut self) {
        // Work on one frame ends sooner than it would come back.
        let (Some(queue), Length::Long | Length::Begun) = (self.queue.clone(), self.length) else {
            return;
        };
        let Some(given) = queue.step_back(self.lane, self.pace, self.cpu_time()) else {
            return;
        };
        // Its worker was handed on.
        self.queue = None;
        let turn = given.blocking_recv();
        *self = turn.expect("every lane with requests is served in the end");
        self.begin();
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        if let Some(queue) = self.queue.take() {
            let ends = self.length != Length::Short;
            queue.hand_on(self.lane, self.pace, self.cpu_time(), ends);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_client_with_one_request_does_not_wait_behind_all_of_another() {
        let queue = FairQueue::new(1);
        let mut first = queue.acquire(Lane(1), Length::Short).await;
        first.begin();
        let (done, mut order) = tokio::sync::mpsc::unbounded_channel();
        let ask = |lane: u64| {
            let (queue, done) = (queue.clone(), done.clone());
            tokio::spawn(async move {
                let turn = queue.acquire(Lane(lane), Length::Short).await;
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
        assert_eq!(queue.running(), 0);
    }

    #[tokio::test]
    async fn work_on_many_frames_lets_others_go_between_two_of_them() {
        let queue = FairQueue::new(1);
        let mut long = queue.acquire(Lane(1), Length::Long).await;
        // Nobody waits.
        long.step_back();
        assert_eq!(queue.running(), 1);
        let (done, order) = std::sync::mpsc::channel();
        let short = tokio::spawn({
            let (queue, done) = (queue.clone(), done.clone());
            async move {
                let turn = queue.acquire(Lane(2), Length::Short).await;
                done.send("short").unwrap();
                drop(turn);
            }
        });
        while !queue.lock().lanes.contains_key(&Lane(2)) {
            tokio::task::yield_now().await;
        }
        let frames = tokio::task::spawn_blocking(move || {
            long.begin();
            long.step_back();
            done.send("long").unwrap();
        });
        short.await.unwrap();
        frames.await.unwrap();
        assert_eq!(order.iter().collect::<Vec<_>>(), ["short", "long"]);
        assert_eq!((queue.running(), queue.lock().long), (0, 0));
    }

    #[tokio::test]
    async fn work_on_one_frame_keeps_its_worker() {
        let queue = FairQueue::new(1);
        let mut short = queue.acquire(Lane(1), Length::Short).await;
        let other = tokio::spawn({
            let queue = queue.clone();
            async move { drop(queue.acquire(Lane(2), Length::Long).await) }
        });
        while !queue.lock().lanes.contains_key(&Lane(2)) {
            tokio::task::yield_now().await;
        }
        // It would wait for ever for the other, which runs on this thread.
        short.step_back();
        drop(short);
        other.await.unwrap();
        assert_eq!((queue.running(), queue.lock().long), (0, 0));
    }

    #[tokio::test]
    async fn quick_work_never_waits_behind_slow_work() {
        let queue = FairQueue::new(1);
        let mut first = queue.acquire(Lane(1), Length::Short).await;
        // It took as long as a large picture takes.
        first.queue = None;
        queue.hand_on(Lane(1), Pace::Quick, Duration::from_millis(50), false);
        let slow = queue.acquire(Lane(1), Length::Short).await;
        // The only worker of quick work is free.
        let quick = queue.acquire(Lane(2), Length::Short).await;
        assert_eq!(queue.running(), 2);
        let mut behind = Box::pin(queue.acquire(Lane(1), Length::Short));
        assert!(futures_util::poll!(&mut behind).is_pending());
        drop(quick);
        assert!(futures_util::poll!(&mut behind).is_pending());
        drop(slow);
        drop(behind.await);
    }

    #[tokio::test]
    async fn requests_whose_clients_have_gone_lose_no_worker() {
        let queue = FairQueue::new(1);
        let turn = queue.acquire(Lane(1), Length::Short).await;
        let gone = tokio::spawn({
            let queue = queue.clone();
            async move { queue.acquire(Lane(2), Length::Short).await }
        });
        while !queue.lock().lanes.contains_key(&Lane(2)) {
            tokio::task::yield_now().await;
        }
        gone.abort();
        assert!(gone.await.unwrap_err().is_cancelled());
        drop(turn);
        assert_eq!(queue.running(), 0);
        drop(queue.acquire(Lane(2), Length::Short).await);
        assert_eq!(queue.running(), 0);
    }
}
