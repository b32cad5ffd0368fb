//! Which requests may work: a queue before the workers.
//!
//! A request whose body has arrived takes a place in the queue; it is refused at once when there is none. Then it waits
//! for a worker, which clients get [in turns](super::fair_queue). All its permits move into the work itself. A request
//! that times out or whose client goes away does not end work that has begun, so its permits stay taken until that work
//! has ended, and never more threads work than there are workers.

use super::executor::{AfterWork, Executor};
use super::fair_queue::{FairQueue, WorkerSlot};
use super::flows::Flow;
use super::queue_permit::{Places, QueuePermit, Reservation, Ticket};
use crate::planted::PlantedFault;
use crate::sync::{Mutex, lock};
use std::any::Any;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::oneshot;

/// The queue is full; try again later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the queue is full")]
pub struct QueueFull;

/// The work panicked: what the panic said. The panic hook has already reported it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the work panicked: {0}")]
pub struct WorkPanicked(String);

impl WorkPanicked {
    fn of(panic: &(dyn Any + Send)) -> Self {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
        Self(text.unwrap_or("a value that is not text").to_owned())
    }
}

/// Why work has no outcome.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoOutcome {
    /// The work was refused before it began: the client's requests wait too long for a worker.
    #[error("the client's requests wait too long")]
    Overload,
    /// The work panicked.
    #[error(transparent)]
    Panicked(#[from] WorkPanicked),
}

/// Work that waits for a worker. Dropping it drops the work, if no worker has taken it.
struct Unstarted<W>(Arc<Mutex<Option<W>>>);

impl<W> Drop for Unstarted<W> {
    fn drop(&mut self) {
        // The work is dropped after the lock is released.
        let _work = lock(&self.0).take();
    }
}

/// A queue before the workers. Clones share both.
#[derive(Debug, Clone)]
pub struct Admission {
    queue: Arc<Places>,
    pub(super) workers: FairQueue,
    executor: Executor,
}

impl Admission {
    /// At most `queue` requests wait or work at a time, besides one of each client that has no other; of these at most
    /// `workers` quick ones and as many slow ones are at work. Where all requests of a client wait longer than `delay`,
    /// those that wait twice as long are refused for newer ones; at zero none is.
    ///
    /// # Errors
    /// The system gives no threads for the workers.
    pub fn new(queue: usize, workers: usize, delay: Duration) -> io::Result<Self> {
        Ok(Self::on(Executor::threads(workers)?, queue, workers, delay))
    }

    /// As [`new`](Self::new), with the work done by `executor`.
    pub fn on(executor: Executor, queue: usize, workers: usize, delay: Duration) -> Self {
        Self {
            queue: Places::new(queue),
            workers: FairQueue::new(workers, delay).before(executor.clone()),
            executor,
        }
    }

    /// Whether there is a place in the queue for a client now. Another request may take it before
    /// [`enter`](Self::enter) is called.
    ///
    /// # Errors
    /// There is no place.
    pub fn check_place(&self, flow: Flow) -> Result<(), QueueFull> {
        match self.queue.has_place(flow) {
            true => Ok(()),
            false => Err(QueueFull),
        }
    }

    /// Takes a place in the queue for a client's request, which holds `held` until its work has ended.
    ///
    /// # Errors
    /// All places are taken that this client may have.
    pub fn enter(&self, flow: Flow, held: Reservation) -> Result<QueuePermit, QueueFull> {
        self.rejoin(Ticket::new(flow, held))
    }

    /// Takes a place in the queue, and waits for it in order of arrival. The request then waits for a worker however
    /// long that takes.
    pub async fn enter_in_order(&self, flow: Flow, held: Reservation) -> QueuePermit {
        let place = self.queue.take_in_order(flow).await;
        QueuePermit::new(Ticket::new(flow, held), place).waiting()
    }

    /// Takes a place in the queue for a request that has left it.
    ///
    /// # Errors
    /// All places are taken that this client may have.
    pub fn rejoin(&self, request: Ticket) -> Result<QueuePermit, QueueFull> {
        let place = self.queue.take(request.flow()).ok_or(QueueFull)?;
        Ok(QueuePermit::new(request, place))
    }

    /// Waits for a worker and runs `work` on its thread. Work may give up the worker for a while through its
    /// [`WorkerSlot`]. If the future is dropped before a worker is free, the work is not done; if later, the work goes
    /// on and keeps its permits until it has ended.
    ///
    /// # Errors
    /// The work panicked, or it waited too long for a worker.
    pub async fn run<T, F>(&self, queue: QueuePermit, work: F) -> Result<T, NoOutcome>
    where
        T: Send + 'static,
        F: FnOnce(&mut WorkerSlot) -> T + Send + 'static,
    {
        let asked = queue.asked();
        let span = tracing::Span::current();
        let (send, outcome) = oneshot::channel();
        // If this future is dropped before a worker takes the work, the work and its permits are dropped with it.
        let unstarted = Unstarted(Arc::new(Mutex::new(Some((queue, work)))));
        let (taken, executor) = (unstarted.0.clone(), self.executor.clone());
        let start = move |mut turn: WorkerSlot| {
            let Some((queue, work)) = lock(&taken).take() else {
                return Err(turn);
            };
            let class = turn.class();
            let work = Box::new(move || -> AfterWork {
                turn.begin();
                // A panic drops `work`, so no half-changed value is read.
                let outcome = catch_unwind(AssertUnwindSafe(|| span.in_scope(|| work(&mut turn))));
                match PlantedFault::KeepsPlace.is_here() && send.is_closed() {
                    true => std::mem::forget(queue),
                    false => drop(queue),
                }
                Box::new(move || {
                    drop(turn);
                    // If the client has gone, nobody receives the outcome.
                    let _ = send.send(outcome);
                })
            });
            executor.start(class, work);
            Ok(())
        };
        self.workers.enter(asked, Box::new(start));
        // Work that has begun always sends its outcome. So without one it was refused.
        let outcome = outcome.await.map_err(|_| NoOutcome::Overload)?;
        outcome.map_err(|panic| WorkPanicked::of(panic.as_ref()).into())
    }

    /// Free places in the queue that any client may take.
    pub fn queue_places(&self) -> usize {
        self.queue.free()
    }

    /// Requests with a place in the queue.
    pub fn requests_inside(&self) -> usize {
        self.queue.len()
    }

    /// Workers that have work.
    pub fn busy_workers(&self) -> usize {
        self.workers.running()
    }
}

#[cfg(test)]
mod tests {
    use super::super::flows::Job;
    use super::super::work_limit::{CpuSpent, Stopped, WorkLimit};
    use super::*;
    use crate::clock;
    use std::sync::mpsc;

    fn enter(admission: &Admission) -> Result<QueuePermit, QueueFull> {
        admission.enter(Flow(0), Box::new(()))
    }

    #[tokio::test]
    async fn the_queue_refuses_when_full_and_frees_on_drop() {
        let admission = Admission::new(1, 1, Duration::ZERO).unwrap();
        let permit = enter(&admission).unwrap();
        assert_eq!(admission.check_place(Flow(0)), Err(QueueFull));
        assert_eq!(enter(&admission).unwrap_err(), QueueFull);
        drop(permit);
        assert!(enter(&admission).is_ok());
    }

    #[tokio::test]
    async fn a_free_place_goes_to_the_request_that_waited_longest() {
        let admission = Admission::new(1, 1, Duration::ZERO).unwrap();
        let taken = enter(&admission).unwrap();
        // Each client may have one place beyond the queue.
        let _spare = admission.enter_in_order(Flow(1), Box::new(())).await;
        let mut first = Box::pin(admission.enter_in_order(Flow(0), Box::new(())));
        let mut second = Box::pin(admission.enter_in_order(Flow(1), Box::new(())));
        assert!(futures_util::poll!(&mut first).is_pending());
        assert!(futures_util::poll!(&mut second).is_pending());
        drop(taken);
        let barging = admission.enter(Flow(1), Box::new(()));
        assert_eq!(barging.unwrap_err(), QueueFull, "others wait");
        assert!(futures_util::poll!(&mut second).is_pending());
        drop(first.await);
        assert_eq!(second.await.flow(), Flow(1));
    }

    #[tokio::test]
    async fn a_cancelled_request_keeps_its_permits_until_the_work_has_ended() {
        let admission = Admission::new(1, 1, Duration::ZERO).unwrap();
        let (started_tx, started) = mpsc::channel();
        let (finish, finish_rx) = mpsc::channel::<()>();
        let queue = enter(&admission).unwrap();
        let request = tokio::spawn({
            let admission = admission.clone();
            async move {
                let work = move |_: &mut WorkerSlot| {
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
        assert_eq!((admission.queue_places(), admission.busy_workers()), (0, 1));
        finish.send(()).unwrap();
        drop(admission.workers.ask(Flow(0), Job::Single).await);
        assert_eq!(admission.busy_workers(), 0);
    }

    #[tokio::test]
    async fn work_is_never_done_on_the_thread_that_asks_for_it() {
        let admission = Admission::new(9, 2, Duration::ZERO).unwrap();
        let here = std::thread::current().id();
        for _ in 0..20 {
            let queue = enter(&admission).unwrap();
            let there = admission.run(queue, |_| std::thread::current().id());
            assert_ne!(there.await.unwrap(), here);
        }
        assert_eq!((admission.queue_places(), admission.busy_workers()), (9, 0));
    }

    #[tokio::test]
    async fn a_thread_goes_on_with_the_work_that_waits_for_its_worker() {
        let admission = Admission::new(9, 1, Duration::ZERO).unwrap();
        // Waits until all threads are idle: one that starts late would be the one that became idle last.
        while !format!("{:?}", admission.executor).starts_with("[Workers(9 idle)") {
            tokio::task::yield_now().await;
        }
        let (go, wait) = mpsc::channel::<()>();
        let first = enter(&admission).unwrap();
        let mut first = Box::pin(admission.run(first, move |_| {
            wait.recv().unwrap();
            std::thread::current().id()
        }));
        assert!(futures_util::poll!(&mut first).is_pending());
        let mut others: Vec<_> = (0..5)
            .map(|_| enter(&admission).unwrap())
            .map(|queue| Box::pin(admission.run(queue, |_| std::thread::current().id())))
            .collect();
        for other in &mut others {
            assert!(futures_util::poll!(other).is_pending());
        }
        go.send(()).unwrap();
        let thread = first.await.unwrap();
        for other in others {
            assert_eq!(other.await.unwrap(), thread);
        }
    }

    #[tokio::test]
    async fn work_whose_client_has_gone_before_it_began_is_not_done() {
        let admission = Admission::new(2, 1, Duration::ZERO).unwrap();
        let (go, wait) = mpsc::channel::<()>();
        let first = enter(&admission).unwrap();
        let mut first = Box::pin(admission.run(first, move |_| wait.recv().unwrap()));
        assert!(futures_util::poll!(&mut first).is_pending());
        let second = enter(&admission).unwrap();
        let mut second = Box::pin(admission.run(second, |_| panic!("nobody waits for it")));
        assert!(futures_util::poll!(&mut second).is_pending());
        assert_eq!(admission.queue_places(), 0);
        drop(second);
        assert_eq!(admission.queue_places(), 1, "its place is free at once");
        go.send(()).unwrap();
        first.await.unwrap();
        assert_eq!((admission.queue_places(), admission.busy_workers()), (2, 0));
    }

    #[tokio::test]
    async fn a_panic_is_an_error_and_frees_the_permits() {
        let admission = Admission::new(1, 1, Duration::ZERO).unwrap();
        let queue = enter(&admission).unwrap();
        let result = admission.run(queue, |_| panic!("a test panics")).await;
        let panicked: Result<(), NoOutcome> = result;
        let told = WorkPanicked("a test panics".to_owned());
        assert_eq!(panicked, Err(NoOutcome::Panicked(told)));
        assert_eq!((admission.queue_places(), admission.busy_workers()), (1, 0));
    }

    fn limit() -> WorkLimit {
        let long = Duration::from_secs(600);
        WorkLimit::new(clock::now() + long, long, CpuSpent::default())
    }

    #[tokio::test]
    async fn parts_of_a_request_are_done_side_by_side_where_a_worker_is_idle() {
        let admission = Admission::new(9, 2, Duration::ZERO).unwrap();
        let queue = enter(&admission).unwrap();
        let (first, of_first) = mpsc::channel();
        let (second, of_second) = mpsc::channel();
        let parts = vec![(first, of_second, 1), (second, of_first, 2)];
        let done = admission.run(queue, move |turn| {
            let limit = limit();
            let (parts, met) = limit
                .start(turn)
                .side_by_side(parts, |(here, other, number)| {
                    here.send(()).unwrap();
                    *number *= 10;
                    other.recv_timeout(Duration::from_secs(60)).is_ok()
                });
            let numbers: Vec<i32> = parts.iter().map(|(.., number)| *number).collect();
            (numbers, met)
        });
        let expected = (vec![10, 20], Ok(vec![true, true]));
        assert_eq!(done.await.unwrap(), expected);
        while admission.busy_workers() > 0 {
            tokio::task::yield_now().await;
        }
    }

    #[tokio::test]
    async fn parts_stay_on_their_thread_where_no_worker_is_idle_and_come_back_when_work_stops() {
        let admission = Admission::new(9, 1, Duration::ZERO).unwrap();
        let queue = enter(&admission).unwrap();
        let done = admission.run(queue, move |turn| {
            let limit = limit();
            let here = std::thread::current().id();
            let is_here = move |_: &mut i32| std::thread::current().id() == here;
            let (_, all) = limit.start(turn).side_by_side(vec![1, 2, 3], is_here);
            assert_eq!(all, Ok(vec![true; 3]));
            drop(limit.abandon_on_drop());
            limit.start(turn).side_by_side(vec![1, 2, 3], is_here)
        });
        let stopped = (vec![1, 2, 3], Err(Stopped::Abandoned));
        assert_eq!(done.await.unwrap(), stopped);
    }

    #[tokio::test]
    async fn a_panic_in_a_part_is_one_of_the_work() {
        let admission = Admission::new(9, 2, Duration::ZERO).unwrap();
        let queue = enter(&admission).unwrap();
        let result = admission.run(queue, |turn| {
            let limit = limit();
            let step = |part: &mut i32| assert_ne!(*part, 2, "a test panics");
            drop(limit.start(turn).side_by_side(vec![1, 2, 3], step));
        });
        assert!(matches!(result.await, Err(NoOutcome::Panicked(_))));
        while admission.busy_workers() > 0 {
            tokio::task::yield_now().await;
        }
    }
}
