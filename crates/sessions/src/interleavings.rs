//! The map of sessions, the sessions and their streams in many orders of their threads: `cargo test --features shuttle
//! --lib interleavings`. The queue, the workers and the budgets have [theirs](crate::scheduler).
//!
//! Each test runs in a number of orders drawn at random, and in as many with few changes between threads, at drawn
//! moments (PCT: Burckhardt and others, 2010). The draws are the same each time unless `SHUTTLE_RANDOM_SEED=N` is set;
//! `BAGTRACK_ORDERS=N` multiplies their number. A failure prints its order, which `shuttle::replay` runs again.

use crate::acts::{CreationKey, IdempotencyStore};
use crate::clock::Clock;
use crate::streams::OpenStreams;
use crate::sync::atomic::{AtomicUsize, Ordering};
use crate::sync::thread::{self, JoinHandle};
use crate::{
    Fingerprint, InsertError, Lease, NewSession, Owner, PerTarget, Registry, Session, SessionName,
    SessionState, Version,
};
use bagtrack_tracker::{Frame, Preset, Rect};
use futures_util::future::{Either, select};
use shuttle::future::block_on;
use shuttle::scheduler::{PctScheduler, RandomScheduler, Scheduler};
use shuttle::{Config, Runner};
use std::pin::pin;
use std::sync::{Arc, LazyLock};
use std::time::Duration;
use tokio::sync::Notify;
use uuid::Uuid;

/// The seed of the draws.
const SEED: u64 = 34;
/// Most changes between threads at drawn moments.
const DEPTH: usize = 3;
/// Bytes of a thread's stack: a tracker needs more than the default.
const STACK: usize = 256 << 10;

/// Runs `test` in twice `schedules` orders of its threads.
pub(crate) fn explore(schedules: usize, test: impl Fn() + Clone + Send + Sync + 'static) {
    let times = std::env::var("BAGTRACK_ORDERS").map_or(Ok(1), |times| times.parse::<usize>());
    let schedules = schedules * times.expect("BAGTRACK_ORDERS is a number");
    run(
        RandomScheduler::new_from_seed(SEED, schedules),
        test.clone(),
    );
    run(PctScheduler::new_from_seed(SEED, DEPTH, schedules), test);
}

fn run(scheduler: impl Scheduler + 'static, test: impl Fn() + Send + Sync + 'static) {
    let mut config = Config::new();
    config.stack_size = STACK;
    // shuttle would warn that it treats all atomics as sequentially consistent, so it finds no faults of weaker orders.
    config.silence_warnings = true;
    Runner::new(scheduler, config).run(test);
}

pub(crate) fn join(threads: impl IntoIterator<Item = JoinHandle<()>>) {
    for thread in threads {
        thread.join().expect("a thread of the test");
    }
}

const IDLE: Duration = Duration::from_secs(600);
const LEASE: Lease = Lease {
    first: IDLE,
    idle: IDLE,
};
/// The id that most tests use.
const ID: Uuid = Uuid::from_u128(1);

/// The state of a new session.
static STATE: LazyLock<SessionState> = LazyLock::new(|| {
    let luma = (0..32 * 24).map(|i| (i * 7 % 251) as u8).collect();
    let frame = Frame::from_luma(32, 24, luma).expect("a frame");
    let target = PerTarget::One(Rect::new(4.0, 4.0, 12.0, 10.0));
    let (print, params) = (Fingerprint::of(b"first"), Preset::Paper.params());
    let state = SessionState::start(&frame, print, &target, &params, None, || Ok(()));
    state.expect("a session begins")
});

/// A registry and how many of its sessions are in memory.
#[derive(Clone)]
struct World {
    registry: Arc<Registry>,
    clock: Clock,
    in_memory: Arc<std::sync::atomic::AtomicUsize>,
}

/// Counts a session until it is freed.
struct InMemory(Arc<std::sync::atomic::AtomicUsize>);

impl Drop for InMemory {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

impl World {
    /// A registry with room for `max_sessions` sessions. With a store, sessions may be removed from memory.
    fn new(max_sessions: usize, has_store: bool) -> Self {
        let clock = Clock::default();
        let registry = Registry::new(max_sessions, 2, LEASE, clock.clone());
        let registry = registry.with_memory((max_sessions + 1) * STATE.session_bytes());
        let registry = Arc::new(match has_store {
            true => registry.with_eviction(),
            false => registry,
        });
        let in_memory = Arc::default();
        Self {
            registry,
            clock,
            in_memory,
        }
    }

    /// Opens a session, of which a store has this version.
    fn open(&self, id: Uuid, version: Option<Version>) -> Result<Arc<Session>, InsertError> {
        self.in_memory.fetch_add(1, Ordering::AcqRel);
        let state = STATE.clone();
        let session = self.registry.insert(NewSession {
            id,
            opening: self.registry.opening([0; 32], &state),
            owner: Owner::default(),
            version,
            ttl: IDLE,
            state,
            held: Box::new(InMemory(self.in_memory.clone())),
        })?;
        // A session that is freed under the lock of the map would wait for itself here.
        let registry = Arc::downgrade(&self.registry);
        let probe = move || {
            registry
                .upgrade()
                .inspect(|registry| assert!(registry.len() < 9));
        };
        *session.on_drop.lock().expect("no probe panics") = Some(Box::new(probe));
        Ok(session)
    }

    /// Checks that `count` sessions are in memory, and that the map and the budget agree.
    fn assert_holds(&self, count: usize) {
        let in_memory = self.in_memory.load(Ordering::Acquire);
        let bytes = self.registry.memory.held();
        let held = (in_memory, self.registry.len(), bytes);
        assert_eq!(held, (count, count, count * STATE.session_bytes()));
    }

    fn spawn(&self, act: impl FnOnce(Self) + Send + 'static) -> JoinHandle<()> {
        let world = self.clone();
        thread::spawn(move || act(world))
    }
}

#[test]
fn the_map_never_holds_more_than_it_may() {
    LazyLock::force(&STATE);
    for has_store in [false, true] {
        explore(2_000, move || {
            const MOST: usize = 2;
            let world = World::new(MOST, has_store);
            let threads = (0..3_u128).map(|client| {
                world.spawn(move |world| {
                    for number in 0..2 {
                        let id = Uuid::from_u128(2 * client + number);
                        let version = has_store.then(|| Version::first(0));
                        drop(world.open(id, version));
                        assert!(world.registry.len() <= MOST);
                    }
                })
            });
            join(threads.collect::<Vec<_>>());
            // With a store some sessions are removed where there was no room.
            match has_store {
                true => world.assert_holds(world.registry.len()),
                false => world.assert_holds(MOST),
            }
            for session in world.registry.all() {
                assert!(world.registry.remove(session.name()));
            }
            world.assert_holds(0);
        });
    }
}

#[test]
fn a_session_ends_once_whoever_ends_it() {
    LazyLock::force(&STATE);
    explore(3_000, || {
        let world = World::new(3, true);
        let session = world.open(ID, Some(Version::first(0))).expect("room");
        let name = session.name();
        let ended = Arc::new(AtomicUsize::new(0));
        let end = |act: fn(&World, SessionName) -> usize| {
            let ended = ended.clone();
            world.spawn(move |world| {
                ended.fetch_add(act(&world, name), Ordering::AcqRel);
            })
        };
        let threads = [
            end(|world, name| usize::from(world.registry.remove(name))),
            end(|world, name| usize::from(world.registry.remove(name))),
            end(|world, _| {
                world.clock.advance(IDLE);
                world.registry.sweep()
            }),
            end(|world, _| {
                drop(world.registry.find(ID, &Owner::default()));
                0
            }),
            world.spawn(move |_| {
                let Ok(permit) = session.enter() else { return };
                // The request gets the session, or is told that this has ended.
                drop(block_on(permit.lock()));
            }),
        ];
        join(threads);
        world.registry.sweep();
        assert!(ended.load(Ordering::Acquire) <= 1, "two have ended it");
        world.assert_holds(0);
    });
}

#[test]
fn a_session_in_use_does_not_expire() {
    LazyLock::force(&STATE);
    explore(5_000, || {
        let world = World::new(3, false);
        let session = world.open(ID, None).expect("room");
        let permit = session.enter().expect("a permit");
        let threads = [
            world.spawn(|world| world.clock.advance(IDLE)),
            world.spawn(|world| assert_eq!(world.registry.sweep(), 0)),
            world.spawn(|world| {
                let found = world.registry.find(ID, &Owner::default());
                assert!(found.is_ok(), "{found:?}");
            }),
        ];
        let locked = block_on(permit.lock()).expect("nobody ends it");
        while world.clock.now() < IDLE {
            thread::yield_now();
        }
        locked.session().renew();
        drop((locked, session));
        join(threads);
        assert!(world.registry.is_live(ID));
        world.assert_holds(1);
    });
}

#[test]
fn a_new_session_does_not_go_with_an_old_one_of_its_id() {
    LazyLock::force(&STATE);
    explore(3_000, || {
        let world = World::new(2, true);
        let old = world.open(ID, Some(Version::first(0))).expect("room");
        let name = old.name();
        let other = Uuid::from_u128(2);
        drop(world.open(other, Some(Version::first(0))));
        let threads = [
            // There is no room: an old session makes some.
            world.spawn(|world| drop(world.open(Uuid::from_u128(3), Some(Version::first(0))))),
            world.spawn(|world| drop(world.registry.find(ID, &Owner::default()))),
            world.spawn(move |world| {
                world.registry.remove(name);
            }),
        ];
        // The client has ended the session, and opens another one under its id that no store has.
        world.registry.forget(&old);
        drop(old);
        let new = world.open(ID, None);
        join(threads);
        if let Ok(new) = new {
            let live = world.registry.live(ID).expect("it lives");
            assert!(Arc::ptr_eq(&live, &new));
        }
        world.assert_holds(world.registry.len());
    });
}

#[test]
fn of_two_streams_at_a_session_the_newer_has_the_place() {
    explore(5_000, || {
        let streams = OpenStreams::default();
        let first = streams.take(ID);
        let threads = [0, 1].map(|_| {
            let streams = streams.clone();
            thread::spawn(move || streams.take(ID))
        });
        // The replaced stream is told, however late it asks.
        block_on(first.replaced());
        let [second, third] = threads.map(|thread| thread.join().expect("a stream"));
        assert!(first.is_replaced());
        let replaced = [&second, &third].map(|place| place.is_replaced());
        assert_eq!(replaced[0] as usize + replaced[1] as usize, 1, "one has it");
        let [older, newer] = match replaced {
            [true, _] => [second, third],
            _ => [third, second],
        };
        block_on(older.replaced());
        let thread = thread::spawn(move || drop(older));
        drop(first);
        assert!(!newer.is_replaced());
        thread.join().expect("a stream ends");
        // The streams that had the place before have not taken it away.
        let last = streams.take(ID);
        assert!(newer.is_replaced() && !last.is_replaced());
    });
}

#[test]
fn a_session_is_one_request_s_at_a_time_and_all_permits_come_back() {
    LazyLock::force(&STATE);
    let went = Arc::new(std::sync::atomic::AtomicUsize::new(0));
    let seen = went.clone();
    explore(3_000, move || {
        let world = World::new(1, false);
        let session = world.open(ID, None).expect("room");
        let inside = Arc::new(AtomicUsize::new(0));
        let alone = Arc::new(AtomicUsize::new(0));
        let mut threads = Vec::new();
        for request in 0..3 {
            let leaves = Arc::new(Notify::new());
            let (session, inside, gone) = (session.clone(), inside.clone(), leaves.clone());
            let (alone, seen) = (alone.clone(), seen.clone());
            threads.push(thread::spawn(move || {
                let locked = async {
                    let permit = session.enter_in_order().await;
                    let is_alone = !permit.overlaps();
                    (is_alone, permit.lock().await.expect("nobody ends it"))
                };
                let (locked, gone) = (pin!(locked), pin!(gone.notified()));
                let locked = block_on(select(locked, gone));
                let Either::Left(((is_alone, locked), _)) = locked else {
                    seen.fetch_add(1, Ordering::Relaxed);
                    return;
                };
                assert_eq!(inside.fetch_add(1, Ordering::AcqRel), 0, "two have it");
                if is_alone {
                    let before = alone.fetch_add(1, Ordering::AcqRel);
                    assert_eq!(before, 0, "neither overlaps the other");
                    alone.fetch_sub(1, Ordering::AcqRel);
                }
                inside.fetch_sub(1, Ordering::AcqRel);
                drop(locked);
            }));
            if request > 0 {
                threads.push(thread::spawn(move || leaves.notify_one()));
            }
        }
        join(threads);
        assert!(!session.is_busy());
        assert_eq!(session.frame_requests.load(Ordering::Acquire), 0);
        let name = session.name();
        drop(session);
        assert!(world.registry.remove(name));
        world.assert_holds(0);
    });
    assert!(went.load(Ordering::Relaxed) > 0, "no client went meanwhile");
}

#[test]
fn requests_of_one_name_open_one_session() {
    explore(5_000, || {
        let store = Arc::new(IdempotencyStore::new(4));
        let opened = Arc::new(AtomicUsize::new(0));
        let name = CreationKey::Key(Owner::default(), "name".to_owned());
        let requests = (0..3).map(|_| {
            let (store, opened, name) = (store.clone(), opened.clone(), name.clone());
            thread::spawn(move || {
                let entry = store.entry(name, |_| true);
                let mut entry = block_on(entry.lock_owned());
                if entry.is_none() {
                    opened.fetch_add(1, Ordering::AcqRel);
                    *entry = Some(ID);
                }
            })
        });
        let mut threads: Vec<_> = requests.collect();
        threads.push(thread::spawn(move || store.prune(|_| true)));
        join(threads);
        assert_eq!(opened.load(Ordering::Acquire), 1);
    });
}
