//! A request to open a session that is sent again gets the same answer, and opens no second one: it has an
//! `Idempotency-Key`, or an id that its client made.
//!
//! Memory keeps a name (key or id) as long as its session lives. Refused requests leave names, too; these are dropped
//! when there are too many. A store keeps no names: the id is computed from the key (`id_of`), and of two sessions of
//! one id the store takes the first. Requests of one name are served one after the other. A refusal is not stored: the
//! request can be sent again.

use crate::Owner;
use crate::sync::{Mutex, lock};
use std::collections::HashMap;
use std::sync::Arc;
use tokio::sync::Mutex as AsyncMutex;
use uuid::Uuid;

/// The name that a client gives to the session that it opens.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum CreationKey {
    /// An idempotency key. Each owner has keys of its own.
    Key(Owner, String),
    /// The session's id, which the client has made.
    Id(Uuid),
}

/// The id of the session that an owner's idempotency key names, from the store's secret: all replicas compute the same
/// id, and clients, who do not know the secret, cannot guess it.
pub(super) fn id_of(secret: &[u8; 32], owner: &Owner, key: &str) -> Uuid {
    let owned = serde_json::json!([owner.name(), key]).to_string();
    let hash = blake3::keyed_hash(secret, owned.as_bytes());
    let (bytes, _) = hash.as_bytes().split_first_chunk().expect("it has 32");
    uuid::Builder::from_random_bytes(*bytes).into_uuid()
}

/// The id of the session that was opened under one name, once there is one. Whoever holds the lock may be about to open
/// the session.
pub type Entry = Arc<AsyncMutex<Option<Uuid>>>;

/// The sessions by the names under which they were opened.
#[derive(Debug)]
pub struct IdempotencyStore {
    entries: Mutex<HashMap<CreationKey, Entry>>,
    max_entries: usize,
}

impl IdempotencyStore {
    /// An empty map. `max_entries` must be larger than the most live sessions and open requests together. When there
    /// are so many entries, those of refused requests and ended sessions are dropped.
    pub fn new(max_entries: usize) -> Self {
        let entries = Mutex::default();
        Self {
            entries,
            max_entries,
        }
    }

    /// The entry of a name, which is made if it is missing.
    pub fn entry(&self, name: CreationKey, is_live: impl Fn(Uuid) -> bool) -> Entry {
        if lock(&self.entries).len() >= self.max_entries {
            self.prune(is_live);
        }
        lock(&self.entries).entry(name).or_default().clone()
    }

    /// Drops the entries that no request uses and that have no live session.
    pub fn prune(&self, is_live: impl Fn(Uuid) -> bool) {
        lock(&self.entries).retain(|_, entry| {
            // A request that holds the entry or waits for it holds a clone.
            let in_use = Arc::strong_count(entry) > 1;
            let stored = entry.try_lock();
            in_use || stored.is_ok_and(|stored| stored.is_some_and(&is_live))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_follows_from_the_secret_the_owner_and_the_key_and_from_all_of_them() {
        let (ann, nobody) = (Owner::named("ann"), Owner::default());
        let id = id_of(&[1; 32], &ann, "a");
        assert_eq!(id, id_of(&[1; 32], &ann, "a"));
        assert_eq!(id.get_version_num(), 4);
        for other in [
            id_of(&[2; 32], &ann, "a"),
            id_of(&[1; 32], &ann, "b"),
            id_of(&[1; 32], &nobody, "a"),
        ] {
            assert_ne!(other, id);
        }
    }

    #[tokio::test]
    async fn answers_go_with_their_sessions_and_entries_in_use_stay() {
        let store = IdempotencyStore::new(4);
        let name = |key: &str| CreationKey::Key(Owner::default(), key.to_owned());
        let live = |id| id == Uuid::from_u128(1);
        for (key, session) in [("a", 1), ("b", 2)] {
            *store.entry(name(key), live).lock().await = Some(Uuid::from_u128(session));
        }
        drop(store.entry(name("refused"), live));
        let used = store.entry(name("used"), live);
        assert_eq!(lock(&store.entries).len(), 4);
        drop(store.entry(name("one more"), live));
        let left = lock(&store.entries).len();
        assert_eq!(
            left, 3,
            "the live session's, the one in use, and the new one"
        );
        drop(used);
        store.prune(|_| false);
        assert_eq!(lock(&store.entries).len(), 0);
    }
}
