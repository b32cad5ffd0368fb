//! `Idempotency-Key`: a request to open a session that is sent again gets the stored answer, and opens no second one.
//!
//! An answer is kept as long as its session lives, so there are never more of them than sessions. Requests with one key
//! are served one after the other. Problems are not stored: the request can be sent again after them.

use super::problems::problem::Problem;
use crate::sessions::Owner;
use axum::body::Bytes;
use axum::http::HeaderMap;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::Mutex as AsyncMutex;
use uuid::Uuid;

/// The header.
pub const IDEMPOTENCY_KEY: &str = "idempotency-key";
const MAX_KEY_BYTES: usize = 255;

/// The key of a request.
///
/// # Errors
/// There is more than one, or it is empty, too long, or not visible ASCII.
pub fn key_of(headers: &HeaderMap) -> Result<Option<String>, Problem> {
    let mut values = headers.get_all(IDEMPOTENCY_KEY).iter();
    let Some(value) = values.next() else {
        return Ok(None);
    };
    let text = value.to_str().unwrap_or("");
    let usable = (1..=MAX_KEY_BYTES).contains(&text.len())
        && text.bytes().all(|byte| byte.is_ascii_graphic());
    match usable && values.next().is_none() {
        true => Ok(Some(text.to_owned())),
        false => Err(Problem::malformed(
            "`Idempotency-Key` must be given once, with 1 to 255 visible ASCII characters.",
        )),
    }
}

/// The answer to a request that opened a session.
#[derive(Debug)]
pub struct StoredAnswer {
    /// The digest of the request.
    pub request: blake3::Hash,
    /// The session.
    pub session: Uuid,
    /// The body of the answer.
    pub body: Bytes,
}

/// The answer of one key, once there is one. Whoever holds the lock is about to make it.
pub type Entry = Arc<AsyncMutex<Option<StoredAnswer>>>;

/// The stored answers by their keys. Each owner has keys of its own.
#[derive(Debug)]
pub struct IdempotencyStore {
    entries: Mutex<HashMap<(Owner, String), Entry>>,
    max_entries: usize,
}

impl IdempotencyStore {
    /// No answers yet. `max_entries` is more than the sessions and the requests inside together: requests that were
    /// refused leave entries, which go when there are so many.
    pub fn new(max_entries: usize) -> Self {
        let entries = Mutex::default();
        Self {
            entries,
            max_entries,
        }
    }

    /// The entry of a key: the one that is there, or a new one.
    pub fn entry(&self, owner: &Owner, key: String, is_live: impl Fn(Uuid) -> bool) -> Entry {
        if self.map().len() >= self.max_entries {
            self.prune(is_live);
        }
        self.map().entry((owner.clone(), key)).or_default().clone()
    }

    /// Drops the answers whose sessions have ended.
    pub fn prune(&self, is_live: impl Fn(Uuid) -> bool) {
        self.map().retain(|_, entry| {
            // A request that holds the entry or waits for it holds a clone.
            let in_use = Arc::strong_count(entry) > 1;
            let stored = entry.try_lock();
            in_use || stored.is_ok_and(|stored| stored.as_ref().is_some_and(|a| is_live(a.session)))
        });
    }

    fn map(&self) -> MutexGuard<'_, HashMap<(Owner, String), Entry>> {
        // Nothing panics while it is held.
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn answers_go_with_their_sessions_and_entries_in_use_stay() {
        let (store, owner) = (IdempotencyStore::new(4), Owner::default());
        let live = |id| id == Uuid::from_u128(1);
        for (key, session) in [("a", 1), ("b", 2)] {
            let entry = store.entry(&owner, key.to_owned(), live);
            *entry.lock().await = Some(StoredAnswer {
                request: blake3::hash(b""),
                session: Uuid::from_u128(session),
                body: Bytes::new(),
            });
        }
        drop(store.entry(&owner, "refused".to_owned(), live));
        let used = store.entry(&owner, "used".to_owned(), live);
        assert_eq!(store.map().len(), 4);
        drop(store.entry(&owner, "one more".to_owned(), live));
        let left = store.map().len();
        assert_eq!(
            left, 3,
            "the live session's, the one in use, and the new one"
        );
        drop(used);
        store.prune(|_| false);
        assert_eq!(store.map().len(), 0);
    }
}
