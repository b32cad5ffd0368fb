//! The streams of sessions. A session has at most one, the newest. A stream that begins at another replica begins a new
//! generation of the record in the store, which tells the stream here that it is replaced.

use crate::Session;
use crate::sync::atomic::{AtomicBool, Ordering};
use crate::sync::{Mutex, lock};
use std::collections::HashMap;
use std::sync::Arc;
use tokio::sync::Notify;
use uuid::Uuid;

/// The open streams by their sessions. Clones share the map.
#[derive(Debug, Clone, Default)]
pub struct OpenStreams(Arc<Mutex<HashMap<Uuid, Arc<Replacement>>>>);

/// Tells a stream that another one has taken its place.
#[derive(Debug, Default)]
struct Replacement {
    done: AtomicBool,
    told: Notify,
}

/// A stream's place at its session, given back when this is dropped.
#[derive(Debug)]
pub struct StreamPlace {
    streams: OpenStreams,
    session: Uuid,
    replacement: Arc<Replacement>,
    /// The generation that the session's record in the store had when the stream began.
    generation: Mutex<Option<u64>>,
}

impl OpenStreams {
    /// Takes the place of the session's stream. The stream that has it is told, and tracks no further frame.
    pub fn take(&self, session: Uuid) -> StreamPlace {
        let replacement = Arc::new(Replacement::default());
        let before = lock(&self.0).insert(session, replacement.clone());
        if let Some(before) = before {
            before.done.store(true, Ordering::Release);
            before.told.notify_one();
        }
        StreamPlace {
            streams: self.clone(),
            session,
            replacement,
            generation: Mutex::default(),
        }
    }
}

impl StreamPlace {
    /// Notes the session's generation: when the stream begins, and again after the store has lost the session's record.
    pub fn begin(&self, session: &Session) {
        *lock(&self.generation) = session.version().map(|version| version.generation);
    }

    /// Whether another stream has the place now, here or at another replica, so that this one has ended.
    pub fn has_ended(&self, session: &Session) -> bool {
        let own = *lock(&self.generation);
        let now = session.version().map(|version| version.generation);
        if own.is_some() && own != now {
            self.replacement.done.store(true, Ordering::Release);
        }
        self.is_replaced()
    }

    /// Whether another stream is known to have the place.
    pub fn is_replaced(&self) -> bool {
        self.replacement.done.load(Ordering::Acquire)
    }

    /// Waits until another stream takes the place.
    pub async fn replaced(&self) {
        self.replacement.told.notified().await;
    }
}

impl Drop for StreamPlace {
    fn drop(&mut self) {
        let mut open = lock(&self.streams.0);
        let own = open.get(&self.session);
        if own.is_some_and(|own| Arc::ptr_eq(own, &self.replacement)) {
            open.remove(&self.session);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_stream_has_the_place_and_gives_it_back() {
        let streams = OpenStreams::default();
        let session = Uuid::from_u128(1);
        let old = streams.take(session);
        let new = streams.take(session);
        let other = streams.take(Uuid::from_u128(2));
        assert!(old.is_replaced() && !new.is_replaced() && !other.is_replaced());
        drop(old);
        assert_eq!(lock(&streams.0).len(), 2, "the new one keeps its place");
        drop((new, other));
        assert!(lock(&streams.0).is_empty());
    }
}
