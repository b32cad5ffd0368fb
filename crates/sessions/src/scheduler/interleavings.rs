//! The queue, the workers and the budgets in many orders of their threads: `cargo test --features shuttle --lib
//! interleavings`.
//!
//! An order in which a thread waits for ever fails as a deadlock. So each test also checks that all threads of workers
//! end.

use super::admission::{Admission, NoOutcome};
use super::budget::{Budget, Charge};
use super::executor::Workers;
use super::flows::{Flow, SizeClass};
use super::queue_permit::Places;
use super::work_limit::{CpuSpent, Stopped, WorkLimit, WorkMeter};
use crate::clock;
use crate::interleavings::{explore, join};
use crate::sync::atomic::{AtomicUsize, Ordering};
use crate::sync::{lock, thread};
use futures_util::future::{Either, select};
use shuttle::future::block_on;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Notify;

const LONG: Duration = Duration::from_secs(600);

/// Counts across the orders of a test. It is an atomic of the system, so that counting is no step of an order.
type Seen = Arc<std::sync::atomic::AtomicUsize>;

fn note(seen: &Seen) {
    seen.fetch_add(1, Ordering::Relaxed);
}

/// Checks that `what` happened in at least one of the orders: otherwise the test would say nothing about it.
fn assert_happened(seen: &Seen, what: &str) {
    let times = seen.load(Ordering::Relaxed);
    println!("{what}: {times} times");
    assert!(times > 0, "in no order: {what}");
}

/// Counts the jobs that have a worker of each class; there are `most` workers of each.
struct AtWork {
    most: usize,
    now: [AtomicUsize; 2],
}

impl AtWork {
    fn new(most: usize) -> Arc<Self> {
        let now = Default::default();
        Arc::new(Self { most, now })
    }

    fn enter(&self, class: SizeClass) {
        let before = self.now[class as usize].fetch_add(1, Ordering::AcqRel);
        assert!(before < self.most, "more at work than there are workers");
    }

    fn leave(&self, class: SizeClass) {
        self.now[class as usize].fetch_sub(1, Ordering::AcqRel);
    }
}

/// Checks that nothing of a queue of `places` places is in use, once the work that has begun has ended.
fn assert_idle(admission: &Admission, places: usize) {
    while admission.busy_workers() > 0 {
        thread::yield_now();
    }
    let inside = admission.requests_inside();
    assert_eq!((admission.queue_places(), inside), (places, 0));
    let flows = lock(&admission.workers.flows);
    assert_eq!((flows.running(), flows.begun), (0, 0));
    let waiting = flows.flows.values().map(|flow| flow.requests.len());
    assert_eq!(waiting.sum::<usize>(), 0);
    assert!(flows.flows.values().all(|flow| flow.running == 0));
}

#[test]
fn every_work_that_entered_runs_once_and_nothing_stays_taken() {
    let yielded = Seen::default();
    let seen = yielded.clone();
    explore(4_000, move || {
        const PLACES: usize = 8;
        let workers = 1;
        let admission = Admission::new(PLACES, workers, Duration::ZERO).expect("threads");
        let at_work = AtWork::new(workers);
        let clients = (0..3).map(|flow| {
            let (admission, at_work, seen) = (admission.clone(), at_work.clone(), seen.clone());
            thread::spawn(move || {
                for frames in [3, 1, 2] {
                    let queue = admission.enter(Flow(flow), Box::new(())).expect("a place");
                    let (at_work, seen) = (at_work.clone(), seen.clone());
                    let runs = Arc::new(AtomicUsize::new(0));
                    let ran = runs.clone();
                    let work = admission.run(queue.for_frames(frames), move |turn| {
                        ran.fetch_add(1, Ordering::AcqRel);
                        at_work.enter(turn.class());
                        for _ in 1..frames {
                            at_work.leave(turn.class());
                            turn.yield_to_others();
                            if format!("{turn:?}").contains("ResumedBatch") {
                                note(&seen);
                            }
                            at_work.enter(turn.class());
                        }
                        at_work.leave(turn.class());
                        frames
                    });
                    assert_eq!(block_on(work), Ok(frames));
                    assert_eq!(runs.load(Ordering::Acquire), 1);
                }
            })
        });
        join(clients.collect::<Vec<_>>());
        assert_eq!(admission.busy_workers(), 0, "answered work has ended");
        assert_idle(&admission, PLACES);
    });
    assert_happened(&yielded, "a batch let others go first");
}

#[test]
fn a_client_that_goes_at_any_moment_loses_no_worker_and_no_place() {
    let (before, within, answered) = (Seen::default(), Seen::default(), Seen::default());
    let seen = (before.clone(), within.clone(), answered.clone());
    explore(4_000, move || {
        const PLACES: usize = 1;
        let (before, within, answered) = seen.clone();
        let admission = Admission::new(PLACES, 1, Duration::ZERO).expect("threads");
        let ended = Arc::new(AtomicUsize::new(0));
        let mut threads = Vec::new();
        for client in 0..4_u64 {
            let leaves = Arc::new(Notify::new());
            let (admission, gone, ended) = (admission.clone(), leaves.clone(), ended.clone());
            let (before, within, answered) = (before.clone(), within.clone(), answered.clone());
            threads.push(thread::spawn(move || {
                let begun = Arc::new(AtomicUsize::new(0));
                let begins = begun.clone();
                let limit = WorkLimit::new(clock::now() + LONG, LONG, CpuSpent::default());
                let request = async {
                    let queue = admission.enter_in_order(Flow(client % 3), Box::new(()));
                    let queue = queue.await.for_frames(2 + client as usize % 2);
                    let _client = limit.abandon_on_drop();
                    let (limit, ended) = (limit.clone(), ended.clone());
                    let work = admission.run(queue, move |turn| {
                        begins.fetch_add(1, Ordering::AcqRel);
                        let frames = two_frames(&mut limit.start(turn));
                        ended.fetch_add(1, Ordering::AcqRel);
                        frames
                    });
                    work.await
                };
                let went = match block_on(select(pin!(request), pin!(gone.notified()))) {
                    Either::Left((outcome, _)) => {
                        assert_eq!(outcome, Ok(Ok(())));
                        note(&answered);
                        false
                    }
                    Either::Right(_) => true,
                };
                // By now the request's future has been dropped.
                match begun.load(Ordering::Acquire) {
                    0 => assert!(went, "it was answered, and never begun"),
                    1 if went => note(&within),
                    times => assert_eq!(times, 1),
                }
                if went {
                    note(&before);
                }
            }));
            if client != 0 {
                threads.push(thread::spawn(move || leaves.notify_one()));
            }
        }
        join(threads);
        assert_idle(&admission, PLACES);
    });
    assert_happened(&before, "a client went before its answer");
    assert_happened(&within, "a client went and its work had begun");
    assert_happened(&answered, "a client had its answer");
}

/// Work that may be stopped before each of its two frames.
fn two_frames(meter: &mut WorkMeter) -> Result<(), Stopped> {
    for _ in 0..2 {
        meter.check()?;
        meter.step(|| ());
    }
    Ok(())
}

#[test]
fn what_is_refused_for_its_wait_is_told_so_and_all_else_runs_once() {
    let refused = Seen::default();
    let seen = refused.clone();
    explore(4_000, move || {
        const PLACES: usize = 8;
        let admission = Admission::new(PLACES, 1, Duration::from_millis(75)).expect("threads");
        let clients = (0..6).map(|client| {
            let (admission, seen) = (admission.clone(), seen.clone());
            thread::spawn(move || {
                let runs = Arc::new(AtomicUsize::new(0));
                let ran = runs.clone();
                let queue = admission.enter(Flow(client / 4), Box::new(()));
                let queue = queue.expect("a place");
                let outcome = block_on(admission.run(queue, move |_| {
                    ran.fetch_add(1, Ordering::AcqRel);
                }));
                let runs = runs.load(Ordering::Acquire);
                match outcome {
                    Ok(()) => assert_eq!(runs, 1),
                    Err(error) => {
                        assert_eq!((error, runs), (NoOutcome::Overload, 0));
                        note(&seen);
                    }
                }
            })
        });
        let mut threads: Vec<_> = clients.collect();
        let queue = admission.workers.clone();
        threads.push(thread::spawn(move || {
            for _ in 0..12 {
                lock(&queue.flows).passed += Duration::from_millis(200);
            }
        }));
        join(threads);
        assert_idle(&admission, PLACES);
    });
    assert_happened(&refused, "work was refused for its wait");
}

#[test]
fn a_place_in_the_queue_is_never_given_twice_nor_lost() {
    let waited = Seen::default();
    let seen = waited.clone();
    explore(8_000, move || {
        const COUNT: usize = 2;
        let places = Places::new(COUNT);
        let held = Arc::new(AtomicUsize::new(0));
        let mut threads = Vec::new();
        for client in 0..5_u64 {
            let leaves = Arc::new(Notify::new());
            let (places, held, gone, seen) =
                (places.clone(), held.clone(), leaves.clone(), seen.clone());
            threads.push(thread::spawn(move || {
                let flow = Flow(client % 2);
                let place = match client {
                    0 => places.take(flow),
                    _ => {
                        let place = pin!(places.take_in_order(flow));
                        match block_on(select(place, pin!(gone.notified()))) {
                            Either::Left((place, _)) => Some(place),
                            Either::Right(_) => {
                                note(&seen);
                                None
                            }
                        }
                    }
                };
                let Some(place) = place else { return };
                let before = held.fetch_add(1, Ordering::AcqRel);
                assert!(before < 2 * COUNT && places.len() > 0);
                held.fetch_sub(1, Ordering::AcqRel);
                drop(place);
            }));
            // The others wait until they have a place.
            if client < 3 {
                threads.push(thread::spawn(move || leaves.notify_one()));
            }
        }
        join(threads);
        assert_eq!((places.free(), places.len()), (COUNT, 0));
        assert!((0..2).all(|flow| places.has_place(Flow(flow))));
    });
    assert_happened(&waited, "a client went while it waited for a place");
}

#[test]
fn every_job_runs_once_and_then_the_threads_end() {
    explore(8_000, || {
        const JOBS: usize = 3;
        let workers = Arc::new(Workers::new(2, 0).expect("threads"));
        let runs: Arc<[AtomicUsize; 2 * JOBS]> = Arc::default();
        let threads = [0, JOBS].map(|first| {
            let (workers, runs) = (workers.clone(), runs.clone());
            thread::spawn(move || {
                for job in first..first + JOBS {
                    let (runs, after) = (runs.clone(), runs.clone());
                    workers.start(Box::new(move || {
                        runs[job].fetch_add(1, Ordering::AcqRel);
                        Box::new(move || drop(after))
                    }));
                }
            })
        });
        drop(workers);
        join(threads);
        // The threads end once nothing waits, and drop their jobs with their clones of `runs`.
        while Arc::strong_count(&runs) > 1 {
            thread::yield_now();
        }
        assert!(runs.iter().all(|runs| runs.load(Ordering::Acquire) == 1));
    });
}

#[test]
fn no_budget_is_ever_above_its_maximum_and_all_is_given_back() {
    let refused = Seen::default();
    let seen = refused.clone();
    explore(8_000, move || {
        let (all, network) = (Budget::new(10), Budget::new(usize::MAX));
        let clients = [0, 1].map(|_| Budget::of_client(8, vec![network.clone()]));
        let threads = (0..4).map(|number| {
            let (all, network, client) =
                (all.clone(), network.clone(), clients[number % 2].clone());
            let seen = seen.clone();
            thread::spawn(move || {
                let mut charge = Charge::new(&all, &client);
                for count in [3, 4] {
                    if charge.grow(count).is_err() {
                        note(&seen);
                    }
                    assert!(all.held() <= 10, "of all clients: {all:?}");
                    assert!(client.held() <= 8, "of a client: {client:?}");
                    assert!(network.held() <= 10, "of a network: {network:?}");
                }
                charge.shrink(2);
                drop(charge);
            })
        });
        join(threads.collect::<Vec<_>>());
        assert_eq!((all.held(), network.held()), (0, 0));
        assert!(clients.iter().all(|client| client.held() == 0));
    });
    assert_happened(&refused, "a budget was used up");
}
