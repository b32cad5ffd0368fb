//! Tests that every store has to pass, whatever keeps its records.

use crate::hostile::HostileStore;
use bagtrack_sessions::{
    Commit, Estimates, Opening, Outcome, Owner, Record, SessionName, SessionStore, Version,
};
use bagtrack_tracker::{Estimate, Rect, Status};
use bytes::Bytes;
use std::time::Duration;
use uuid::Uuid;

/// Longer than any test takes.
pub const TTL: Duration = Duration::from_secs(3600);

pub fn record(incarnation: u64, frame: u64, state: &[u8]) -> Record {
    let estimate = Estimate {
        frame,
        target: Rect::new(1.0, 2.0, 30.0, 40.0),
        score: 1.0,
        status: Status::Tracking,
    };
    Record {
        version: Version::first(frame),
        owner: Owner::named("ann"),
        opening: Opening {
            request: [7; 32],
            estimates: Estimates::One(estimate),
            expires: 9,
            incarnation,
        },
        state: state.to_vec(),
        ttl: TTL,
    }
}

/// A store with a record, which stands at frame 0.
struct Stored<'a> {
    store: &'a dyn SessionStore,
    name: SessionName,
    version: Version,
}

impl<'a> Stored<'a> {
    async fn new(store: &'a dyn SessionStore) -> Self {
        let (id, incarnation) = (Uuid::new_v4(), rand::random::<u64>() >> 1);
        let record = record(incarnation, 0, b"zero");
        let created = store.create(id, &record).await.unwrap();
        assert!(matches!(created, Outcome::Committed(_)), "{created:?}");
        Self {
            store,
            name: SessionName { id, incarnation },
            version: record.version,
        }
    }

    /// Commits a frame after this version.
    async fn commit(
        &self,
        before: Version,
        frame: u64,
        state: Option<&[u8]>,
        takes_over: bool,
    ) -> Outcome {
        let commit = Commit {
            name: self.name,
            before,
            frame,
            state: state.map(Bytes::copy_from_slice),
            takes_over,
            ttl: TTL,
        };
        self.store.commit(commit).await.unwrap()
    }

    async fn check(&self, version: Version, takes_over: bool) -> Outcome {
        let checked = self.store.check(self.name, version, takes_over, Some(TTL));
        checked.await.unwrap()
    }
}

pub fn is_committed(outcome: &Outcome) -> bool {
    matches!(outcome, Outcome::Committed(_))
}

pub fn told(outcome: Outcome) -> Record {
    match outcome {
        Outcome::Conflict(record) => *record,
        other => panic!("{other:?} in place of a record"),
    }
}

async fn a_record_is_read_as_it_was_written(store: &dyn SessionStore) {
    let stored = Stored::new(store).await;
    let loaded = store.load(stored.name.id).await.unwrap().unwrap();
    let mut written = record(stored.name.incarnation, 0, b"zero");
    (written.version, written.ttl) = (stored.version, loaded.ttl);
    assert_eq!(loaded, written);
    assert!(
        loaded.ttl <= TTL && loaded.ttl > TTL / 2,
        "{:?}",
        loaded.ttl
    );
    assert_eq!(store.load(Uuid::new_v4()).await.unwrap(), None);
    let again = store.create(stored.name.id, &record(5, 3, b"other")).await;
    assert_eq!(told(again.unwrap()).state, b"zero");
}

async fn of_two_frames_after_one_version_one_is_committed(store: &dyn SessionStore) {
    let stored = Stored::new(store).await;
    let first = stored.commit(stored.version, 1, Some(b"one"), false).await;
    assert!(is_committed(&first));
    let late = stored.commit(stored.version, 1, Some(b"late"), true).await;
    let late = told(late);
    assert_eq!((&late.state[..], late.version.frame), (&b"one"[..], 1));
    let version = stored.version.committed(1, true);
    assert_eq!(late.version, version);
    assert!(is_committed(&stored.check(version, true).await));
    assert_eq!(
        told(stored.check(stored.version, false).await).state,
        b"one"
    );
}

async fn whoever_lacks_frames_takes_over_at_the_checkpoint(store: &dyn SessionStore) {
    let stored = Stored::new(store).await;
    for frame in 1..4 {
        let before = stored.version.committed(frame - 1, false);
        assert!(is_committed(
            &stored.commit(before, frame, None, false).await
        ));
    }
    let newest = stored.version.committed(3, false);
    // Another replica looks, and then takes over.
    let seen = told(stored.check(stored.version, false).await);
    assert_eq!(seen.version, stored.version);
    assert!(is_committed(&stored.check(newest, false).await));
    let taken = told(stored.check(stored.version.fenced(), true).await);
    assert_eq!((taken.version.frame, taken.version.checkpoint), (0, 0));
    assert!(is_committed(
        &stored.commit(taken.version, 1, Some(b"new"), false).await
    ));
    // The first replica cannot go on from its own copy any more.
    let late = stored.commit(newest, 4, Some(b"old"), false).await;
    assert_eq!(told(late).state, b"new");
}

async fn a_fence_keeps_other_copies_from_going_on(store: &dyn SessionStore) {
    let stored = Stored::new(store).await;
    let fenced = store.fence(stored.name, stored.version).await.unwrap();
    assert!(is_committed(&fenced));
    let late = stored.commit(stored.version, 1, Some(b"late"), false).await;
    let record = told(late);
    assert_eq!(record.version, stored.version.fenced());
    let again = store.fence(stored.name, stored.version).await.unwrap();
    assert_eq!(told(again).version, record.version);
    assert!(is_committed(
        &stored.commit(record.version, 1, None, false).await
    ));
}

async fn an_ended_session_does_not_come_back(store: &dyn SessionStore) {
    let stored = Stored::new(store).await;
    assert!(store.end(stored.name, TTL).await.unwrap());
    assert!(!store.end(stored.name, TTL).await.unwrap());
    assert_eq!(
        stored.check(stored.version, true).await,
        Outcome::Tombstoned
    );
    let late = stored.commit(stored.version, 1, Some(b"one"), true).await;
    assert_eq!(late, Outcome::Tombstoned);
    let same = record(stored.name.incarnation, 0, b"zero");
    let created = store.create(stored.name.id, &same).await.unwrap();
    assert_eq!(created, Outcome::Tombstoned);
    assert_eq!(store.load(stored.name.id).await.unwrap(), None);
    // Another session may get the id. Ending the first one again does not end it.
    let other = record(stored.name.incarnation ^ 1, 0, b"other");
    let created = store.create(stored.name.id, &other).await.unwrap();
    assert!(is_committed(&created));
    assert!(!store.end(stored.name, TTL).await.unwrap());
    let told = told(stored.check(stored.version, false).await);
    assert_eq!(told.opening.incarnation, stored.name.incarnation ^ 1);
    let unknown = SessionName {
        id: Uuid::new_v4(),
        incarnation: 1,
    };
    let checked = store.check(unknown, stored.version, true, None).await;
    assert_eq!(checked.unwrap(), Outcome::NotFound);
}

async fn the_first_secret_stays(store: &dyn SessionStore) {
    // These bytes are no UTF-8, so a store that treats secrets as text would change them.
    let first: [u8; 32] = std::array::from_fn(|i| 255 - i as u8);
    assert_eq!(store.secret(first).await.unwrap(), first);
    assert_eq!(store.secret([2; 32]).await.unwrap(), first);
}

pub async fn holds_for(store: &dyn SessionStore) {
    a_record_is_read_as_it_was_written(store).await;
    of_two_frames_after_one_version_one_is_committed(store).await;
    whoever_lacks_frames_takes_over_at_the_checkpoint(store).await;
    a_fence_keeps_other_copies_from_going_on(store).await;
    an_ended_session_does_not_come_back(store).await;
    the_first_secret_stays(store).await;
}

#[tokio::test]
async fn the_store_in_memory_keeps_to_the_rules() {
    holds_for(&HostileStore::at_once()).await;
}
