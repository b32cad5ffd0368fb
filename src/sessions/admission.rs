//! Who may work: a queue before the workers.
//!
//! A request first takes a place in the queue (refused at once when it is full) and the room for its body,
//! since bodies are what requests in the queue cost; then it waits for a worker. Both permits move into the blocking work itself: a request that times out or whose client
//! goes away does not stop work that has begun, so its permits stay taken until that work has ended, and
//! the number of threads at work is never more than the number of workers. Brief work may be done by the thread that
//! asks for it, in place of a worker and with its permit.

use super::here;
use super::workers::Workers;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot};

/// Bytes that one permit of the room for bodies stands for.
const UNIT: usize = 1024;

/// The queue or the room for bodies is full; try again later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the queue is full")]
pub struct QueueFull;

/// The work panicked, or there was no thread for it. The panic itself has been printed by the panic hook.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WorkLost {
    /// What the panic said, where it was a text.
    #[error("the work panicked: {0}")]
    Panicked(String),
    /// The system gave no thread.
    #[error("there is no thread for the work")]
    NoThread,
}

impl WorkLost {
    fn of(panic: &(dyn Any + Send)) -> Self {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
        Self::Panicked(text.unwrap_or("something that is no text").to_owned())
    }
}

/// A place in the queue, given back when the last clone is dropped.
#[derive(Debug, Clone)]
pub struct QueuePermit {
    _permits: Arc<[OwnedSemaphorePermit; 2]>,
}

/// A queue semaphore before a worker semaphore. Clones share both.
#[derive(Debug, Clone)]
pub struct Admission {
    queue: Arc<Semaphore>,
    bodies: Arc<Semaphore>,
    workers: Arc<Semaphore>,
    /// How many workers there are.
    most: usize,
    threads: Arc<Workers>,
}

impl Admission {
    /// At most `queue` requests are inside at a time with at most `body_bytes` bytes of bodies, at most `workers`
    /// of them at work.
    pub fn new(queue: usize, body_bytes: usize, workers: usize) -> Self {
        Self {
            queue: Arc::new(Semaphore::new(queue)),
            bodies: Arc::new(Semaphore::new(body_bytes.div_ceil(UNIT))),
            workers: Arc::new(Semaphore::new(workers)),
            most: workers,
            threads: Arc::new(Workers::new(workers)),
        }
    }

    /// Takes a place in the queue, with room for a body of `body_bytes`.
    ///
    /// # Errors
    /// All places or the room are taken.
    pub fn enter(&self, body_bytes: usize) -> Result<QueuePermit, QueueFull> {
        let units = u32::try_from(body_bytes.div_ceil(UNIT)).map_err(|_| QueueFull)?;
        let place = self.queue.clone().try_acquire_owned();
        let room = self.bodies.clone().try_acquire_many_owned(units);
        match (place, room) {
            (Ok(place), Ok(room)) => Ok(QueuePermit {
                _permits: Arc::new([place, room]),
            }),
            _ => Err(QueueFull),
        }
    }

    /// Like [`Self::run`], for work that takes a few milliseconds at most: where no worker is busy, and this thread [takes
    /// such work](super::rested), it is done here and now.
    ///
    /// # Errors
    /// The work panicked, or there was no thread for it.
    pub async fn run_brief<T, F>(&self, queue: QueuePermit, work: F) -> Result<T, WorkLost>
    where
        T: Send + 'static,
        F: FnOnce() -> T + Send + 'static,
    {
        let all_are_free = self.free_workers() == self.most;
        match self.workers.clone().try_acquire_owned() {
            Ok(worker) if all_are_free && here::takes_work() => {
                let outcome = catch_unwind(AssertUnwindSafe(work));
                drop((queue, worker));
                outcome.map_err(|panic| WorkLost::of(panic.as_ref()))
            }
            Ok(worker) => self.hand_over((queue, worker), work).await,
            Err(_) => self.run(queue, work).await,
        }
    }

    /// Waits for a worker, in order of arrival, and runs `work` on its thread. Dropping the future
    /// before a worker is free cancels the work; afterwards it runs to its end, holding its permits.
    ///
    /// # Errors
    /// The work panicked, or there was no thread for it.
    pub async fn run<T, F>(&self, queue: QueuePermit, work: F) -> Result<T, WorkLost>
    where
        T: Send + 'static,
        F: FnOnce() -> T + Send + 'static,
    {
        let acquired = self.workers.clone().acquire_owned().await;
        let worker = acquired.expect("the semaphore is never closed");
        self.hand_over((queue, worker), work).await
    }

    async fn hand_over<T, F>(
        &self,
        permits: (QueuePermit, OwnedSemaphorePermit),
        work: F,
    ) -> Result<T, WorkLost>
    where
        T: Send + 'static,
        F: FnOnce() -> T + Send + 'static,
    {
        let span = tracing::Span::current();
        let (send, outcome) = oneshot::channel();
        self.threads.start(Box::new(move || {
            // `work` is used up by a panic, so nobody sees what it left half changed.
            let outcome = catch_unwind(AssertUnwindSafe(|| span.in_scope(work)));
            drop(permits);
            // Nobody waits when the client has gone.
            let _ = send.send(outcome);
        }));
        match outcome.await {
            Ok(outcome) => outcome.map_err(|panic| WorkLost::of(panic.as_ref())),
            Err(_) => Err(WorkLost::NoThread),
        }
    }

    /// Places free in the queue.
    pub fn queue_places(&self) -> usize {
        self.queue.available_permits()
    }

    /// Workers that are free.
    pub fn free_workers(&self) -> usize {
        self.workers.available_permits()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;

    #[tokio::test]
    async fn the_queue_refuses_when_full_and_frees_on_drop() {
        let admission = Admission::new(1, 5000, 1);
        let permit = admission.enter(5000).unwrap();
        assert_eq!(admission.enter(5000).unwrap_err(), QueueFull);
        drop(permit);
        assert!(admission.enter(5000).is_ok());
    }

    #[tokio::test]
    async fn bodies_share_their_room() {
        let admission = Admission::new(9, 5 * UNIT, 1);
        let large = admission.enter(4 * UNIT).unwrap();
        assert_eq!(admission.enter(UNIT + 1).unwrap_err(), QueueFull);
        assert!(admission.enter(UNIT).is_ok());
        drop(large);
        assert!(admission.enter(5 * UNIT).is_ok());
    }

    #[tokio::test]
    async fn a_cancelled_request_keeps_its_permits_until_the_work_has_ended() {
        let admission = Admission::new(1, 5000, 1);
        let (started_tx, started) = mpsc::channel();
        let (finish, finish_rx) = mpsc::channel::<()>();
        let queue = admission.enter(5000).unwrap();
        let request = tokio::spawn({
            let admission = admission.clone();
            async move {
                let work = move || {
                    started_tx.send(()).unwrap();
                    finish_rx.recv().unwrap();
                };
                admission.run(queue, work).await
            }
        });
        tokio::task::spawn_blocking(move || started.recv().unwrap())
            .await
            .unwrap();
        request.abort();
        assert!(request.await.unwrap_err().is_cancelled());
        assert_eq!((admission.queue_places(), admission.free_workers()), (0, 0));
        finish.send(()).unwrap();
        let free = admission.workers.acquire().await.unwrap();
        drop(free);
        assert_eq!(admission.free_workers(), 1);
    }

    #[tokio::test]
    async fn brief_work_is_done_here_where_no_worker_is_busy_and_the_thread_takes_it() {
        let admission = Admission::new(9, 5000, 2);
        let brief = async || {
            let queue = admission.enter(0).unwrap();
            let done = admission.run_brief(queue, || std::thread::current().id());
            done.await.unwrap()
        };
        let here = std::thread::current().id();
        assert_ne!(brief().await, here);
        here::rested();
        assert_eq!(brief().await, here);
        assert_ne!(brief().await, here);
        here::rested();
        let busy = admission.workers.clone().acquire_owned().await.unwrap();
        assert_ne!(brief().await, here);
        let busy = (
            busy,
            admission.workers.clone().acquire_owned().await.unwrap(),
        );
        let waiting = tokio::time::timeout(std::time::Duration::ZERO, brief());
        assert!(waiting.await.is_err());
        drop(busy);
        assert_eq!(brief().await, here);
        assert_eq!((admission.queue_places(), admission.free_workers()), (9, 2));
    }

    #[tokio::test]
    async fn a_panic_is_an_error_and_frees_the_permits() {
        let admission = Admission::new(1, 5000, 1);
        let queue = admission.enter(5000).unwrap();
        let result = admission.run(queue, || panic!("a test panics")).await;
        let panicked: Result<(), WorkLost> = result;
        assert_eq!(
            panicked,
            Err(WorkLost::Panicked("a test panics".to_owned()))
        );
        assert_eq!((admission.queue_places(), admission.free_workers()), (1, 1));
    }
}
