//! Which requests may work: a queue before the workers.
//!
//! A request first takes a place in the queue and a share of the bytes that all bodies may have together; it is
//! refused at once when either is used up. Then it waits for a worker. All its permits move into the work itself. A
//! request that times out or whose client goes away does not stop work that has begun, so its permits stay taken until
//! that work has ended, and never more threads work than there are workers.

use super::workers::Workers;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot};

/// Bytes that one permit of the byte budget stands for.
const BYTES_PER_PERMIT: usize = 1024;

/// The queue is full or the byte budget is used up; try again later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the queue is full")]
pub struct QueueFull;

/// The work panicked, or there was no thread for it. The panic hook has already reported a panic.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WorkLost {
    /// What the panic said, where it was text.
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
        Self::Panicked(text.unwrap_or("a value that is not text").to_owned())
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
    threads: Arc<Workers>,
}

impl Admission {
    /// At most `queue` requests at a time, with at most `body_bytes` bytes of bodies together; at most `workers` of
    /// them at work.
    pub fn new(queue: usize, body_bytes: usize, workers: usize) -> Self {
        Self {
            queue: Arc::new(Semaphore::new(queue)),
            bodies: Arc::new(Semaphore::new(body_bytes.div_ceil(BYTES_PER_PERMIT))),
            workers: Arc::new(Semaphore::new(workers)),
            threads: Arc::new(Workers::new(workers)),
        }
    }

    /// Takes a place in the queue, and `body_bytes` of the byte budget.
    ///
    /// # Errors
    /// All places or all bytes are taken.
    pub fn enter(&self, body_bytes: usize) -> Result<QueuePermit, QueueFull> {
        let units = u32::try_from(body_bytes.div_ceil(BYTES_PER_PERMIT)).map_err(|_| QueueFull)?;
        let place = self.queue.clone().try_acquire_owned();
        let bytes = self.bodies.clone().try_acquire_many_owned(units);
        match (place, bytes) {
            (Ok(place), Ok(bytes)) => Ok(QueuePermit {
                _permits: Arc::new([place, bytes]),
            }),
            _ => Err(QueueFull),
        }
    }

    /// Waits for a worker, in order of arrival, and runs `work` on its thread. If the future is dropped before a worker
    /// is free, the work is not done; afterwards it runs to its end and keeps its permits.
    ///
    /// # Errors
    /// The work panicked, or there was no thread for it.
    pub async fn run<T, F>(&self, queue: QueuePermit, work: F) -> Result<T, WorkLost>
    where
        T: Send + 'static,
        F: FnOnce() -> T + Send + 'static,
    {
        let acquired = self.workers.clone().acquire_owned().await;
        let permits = (queue, acquired.expect("the semaphore is never closed"));
        let span = tracing::Span::current();
        let (send, outcome) = oneshot::channel();
        self.threads.start(Box::new(move || {
            // A panic drops `work`, so no half-changed value is read.
            let outcome = catch_unwind(AssertUnwindSafe(|| span.in_scope(work)));
            drop(permits);
            // It cannot be sent when the client has gone.
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
    async fn bodies_share_their_byte_budget() {
        let admission = Admission::new(9, 5 * BYTES_PER_PERMIT, 1);
        let large = admission.enter(4 * BYTES_PER_PERMIT).unwrap();
        assert_eq!(
            admission.enter(BYTES_PER_PERMIT + 1).unwrap_err(),
            QueueFull
        );
        assert!(admission.enter(BYTES_PER_PERMIT).is_ok());
        drop(large);
        assert!(admission.enter(5 * BYTES_PER_PERMIT).is_ok());
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
    async fn work_is_never_done_on_the_thread_that_asks_for_it() {
        let admission = Admission::new(9, 5000, 2);
        let here = std::thread::current().id();
        for _ in 0..20 {
            let queue = admission.enter(0).unwrap();
            let there = admission.run(queue, || std::thread::current().id());
            assert_ne!(there.await.unwrap(), here);
        }
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
