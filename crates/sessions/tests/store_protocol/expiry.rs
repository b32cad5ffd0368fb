//! How long the store in a folder keeps what it has, by a clock that is moved.

use crate::folder::{Known, open_by};
use bagtrack_sessions::{Clock, FileStore, Outcome, SessionStore};
use std::time::{Duration, SystemTime};
use tempfile::TempDir;
use uuid::Uuid;

const MINUTE: Duration = Duration::from_secs(60);
const HOUR: Duration = Duration::from_secs(3600);
/// A minute less than an hour. Where the store is opened anew its clock may differ by moments, so a test looks at minutes.
const ALMOST: Duration = Duration::from_secs(3600 - 60);

/// The store after it was closed and has looked for what has expired.
async fn swept(store: FileStore, folder: &TempDir, clock: &Clock) -> FileStore {
    drop(store);
    let store = open_by(folder.path(), clock);
    // It looks after the first call at the latest, and before the second.
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
    // A look does so only if it is to.
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
