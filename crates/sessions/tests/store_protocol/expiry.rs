//! How long the store in a folder keeps its sessions, by a clock that the test moves.

use crate::folder::{Known, open_by};
use bagtrack_sessions::{Clock, FileStore, Outcome, SessionStore};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};
use tempfile::TempDir;
use uuid::Uuid;

const MINUTE: Duration = Duration::from_secs(60);
const HOUR: Duration = Duration::from_secs(3600);
/// A minute less than an hour. Where the store is opened anew its clock may differ by moments, so a test looks at
/// minutes.
const ALMOST: Duration = Duration::from_secs(3600 - 60);

/// Closes the store and opens it again. The returned store has swept what has expired.
async fn swept(store: FileStore, folder: &TempDir, clock: &Clock) -> FileStore {
    drop(store);
    let store = open_by(folder.path(), clock);
    // The store sweeps after the first call at the latest, and before the second.
    for _ in 0..2 {
        store.load(Uuid::nil()).await.unwrap();
    }
    store
}

fn time_left(outcome: Outcome) -> Duration {
    match outcome {
        Outcome::Committed(left) => left,
        other => panic!("{other:?} in place of the time that is left"),
    }
}

#[tokio::test]
async fn a_session_is_kept_until_its_time_is_over() {
    let (folder, clock) = (TempDir::new().unwrap(), Clock::default());
    let mut store = open_by(folder.path(), &clock);
    let mut session = Known::create(&store, 1, HOUR).await;
    clock.advance(ALMOST);
    store = swept(store, &folder, &clock).await;
    let record = store.load(session.name.id).await.unwrap().unwrap();
    assert!(record.ttl < 2 * MINUTE, "{:?}", record.ttl);
    // A frame renews it.
    session.advance_for(&store, HOUR).await;
    clock.advance(ALMOST);
    store = swept(store, &folder, &clock).await;
    // A check renews it only with `renew`.
    let look = |renew| store.check(session.name, session.version, false, renew);
    assert!(time_left(look(None).await.unwrap()) < 2 * MINUTE);
    assert!(time_left(look(None).await.unwrap()) < 2 * MINUTE);
    assert!(time_left(look(Some(HOUR)).await.unwrap()) > ALMOST);
    assert!(time_left(look(None).await.unwrap()) > ALMOST);
    clock.advance(HOUR);
    assert_eq!(look(None).await.unwrap(), Outcome::NotFound);
    assert_eq!(look(Some(HOUR)).await.unwrap(), Outcome::NotFound);
    assert!(store.load(session.name.id).await.unwrap().is_none());
    let fenced = store.fence(session.name, session.version).await;
    assert_eq!(fenced.unwrap(), Outcome::NotFound);
}

#[tokio::test]
async fn an_ended_session_is_known_as_ended_for_its_time() {
    let (folder, clock) = (TempDir::new().unwrap(), Clock::default());
    let mut store = open_by(folder.path(), &clock);
    let session = Known::create(&store, 1, HOUR).await;
    assert!(store.end(session.name, HOUR).await.unwrap());
    clock.advance(ALMOST);
    store = swept(store, &folder, &clock).await;
    let look = || store.check(session.name, session.version, false, None);
    assert_eq!(look().await.unwrap(), Outcome::Tombstoned);
    assert!(!store.end(session.name, MINUTE).await.unwrap());
    clock.advance(2 * MINUTE);
    assert_eq!(look().await.unwrap(), Outcome::NotFound);
    Known::create(&store, 1, HOUR).await;
}

#[tokio::test]
async fn the_secret_outlives_sessions() {
    let (folder, clock) = (TempDir::new().unwrap(), Clock::default());
    let mut store = open_by(folder.path(), &clock);
    assert_eq!(store.secret([1; 32]).await.unwrap(), [1; 32]);
    clock.advance(1000 * 24 * HOUR);
    store = swept(store, &folder, &clock).await;
    assert_eq!(store.secret([2; 32]).await.unwrap(), [1; 32]);
}

#[tokio::test]
async fn the_time_in_which_the_store_is_closed_counts() {
    let begun = || SystemTime::UNIX_EPOCH + 1_000_000 * HOUR;
    let later = || SystemTime::UNIX_EPOCH + 1_000_001 * HOUR + MINUTE;
    let folder = TempDir::new().unwrap();
    let store = open_by(folder.path(), &Clock::with_wall(begun));
    let short = Known::create(&store, 1, HOUR).await;
    let long = Known::create(&store, 2, HOUR + 2 * MINUTE).await;
    drop(store);
    let store = open_by(folder.path(), &Clock::with_wall(later));
    assert!(store.load(short.name.id).await.unwrap().is_none());
    let left = store.load(long.name.id).await.unwrap().unwrap().ttl;
    assert!(left > MINUTE / 2 && left < 2 * MINUTE, "{left:?}");
}

/// Hours since 1970 by the wall clock of the test below.
static HOURS: AtomicU64 = AtomicU64::new(0);

/// Boards without a battery set their clock soon after the start, and so does a machine after it was suspended. Neither
/// may end sessions at the next restart.
#[tokio::test]
async fn a_wall_clock_that_is_set_ends_no_session_and_lets_none_live_on() {
    let clock = || {
        let wall = || SystemTime::UNIX_EPOCH + HOUR * HOURS.load(Ordering::Relaxed) as u32;
        Clock::with_wall(wall)
    };
    const DAY: u64 = 24;
    let folder = TempDir::new().unwrap();
    let mut seed = 0;
    // Set forward and back while the store is open.
    for (begins, then) in [(1, 56 * 365 * DAY), (56 * 365 * DAY, 55 * 365 * DAY)] {
        HOURS.store(begins, Ordering::Relaxed);
        let store = open_by(folder.path(), &clock());
        seed += 1;
        let session = Known::create(&store, seed, HOUR + 2 * MINUTE).await;
        let left = async |store: &FileStore| {
            let record = store.load(session.name.id).await.unwrap();
            record.map(|record| record.ttl.as_secs() / 60)
        };
        HOURS.store(then, Ordering::Relaxed);
        assert!(left(&store).await.is_some_and(|left| left >= 60));
        drop(store);
        let store = open_by(folder.path(), &clock());
        assert!(left(&store).await.is_some_and(|left| left >= 60));
        drop(store);
        // The time in which the store is closed counts by the wall clock.
        HOURS.store(then + 1, Ordering::Relaxed);
        let store = open_by(folder.path(), &clock());
        assert!(left(&store).await.is_some_and(|left| left <= 2));
        drop(store);
        HOURS.store(then + 2, Ordering::Relaxed);
        assert_eq!(left(&open_by(folder.path(), &clock())).await, None);
    }
    // The clock of a board begins in 1970 at each start: its sessions expire nevertheless, since the folder's time goes
    // on.
    HOURS.store(56 * 365 * DAY, Ordering::Relaxed);
    let store = open_by(folder.path(), &clock());
    let session = Known::create(&store, 9, HOUR).await;
    drop(store);
    HOURS.store(1, Ordering::Relaxed);
    let of_board = clock();
    let store = open_by(folder.path(), &of_board);
    assert!(store.load(session.name.id).await.unwrap().is_some());
    // The folder has noted its time within the last minute, and goes on from there.
    of_board.advance(HOUR + MINUTE);
    assert_eq!(store.load(session.name.id).await.unwrap(), None);
}
