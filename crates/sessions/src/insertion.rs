//! Adding a session to the map, and making room for it.

use super::random::random;
use super::registry::{Registry, TooManySessions};
use super::scheduler::budget::Charge;
use super::scheduler::queue_permit::Reservation;
use super::session::{NewSession, Opening, Session};
use super::state::SessionState;
use super::sync::lock;
use std::collections::hash_map::Entry;
use std::sync::Arc;
use std::time::Duration;
use uuid::Uuid;

/// Where there is no room, one in this many of the idle sessions in the map is removed.
const EVICTED: usize = 16;

/// Why a session cannot be added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum InsertError {
    /// There is no room, or no memory for a state with its parameters.
    #[error(transparent)]
    Full(#[from] TooManySessions),
    /// A live session has the new one's id.
    #[error("a live session has this id")]
    Taken,
}

impl Registry {
    /// How long a new session lives without a frame.
    pub fn first_lease(&self) -> Duration {
        self.lease.first.min(self.lease.idle)
    }

    /// How long a session lives without a further frame.
    pub fn idle_lease(&self) -> Duration {
        self.lease.idle
    }

    /// The opening of a session by a request with this digest, now.
    pub fn opening(&self, request: [u8; 32], state: &SessionState) -> Opening {
        let expires = self.clock.now() + self.first_lease();
        Opening {
            request,
            estimates: state.latest(),
            expires: self.clock.since_1970(expires).as_secs(),
            incarnation: random(),
        }
    }

    /// Adds a session.
    ///
    /// # Errors
    /// See [`InsertError`].
    pub fn insert(&self, mut new: NewSession) -> Result<Arc<Session>, InsertError> {
        self.check_room()?;
        if self.evicts && self.len() >= self.max_sessions {
            self.evict();
        }
        let full = self.full();
        let held = (new.held, self.hold(&new.state).ok_or(full)?);
        let held: Reservation = Box::new(held);
        new.held = held;
        let session = Session::new(new, self.max_requests, self.lease, self.clock.clone());
        let before = {
            let mut sessions = lock(&self.sessions);
            match sessions.get(&session.id()) {
                Some(live) if !self.has_ended(live) => return Err(InsertError::Taken),
                None if sessions.len() >= self.max_sessions => return Err(full.into()),
                _ => sessions.insert(session.id(), session.clone()),
            }
        };
        // The lock has been released: this may free the session that had the id.
        before.into_iter().for_each(|ended| ended.close());
        Ok(session)
    }

    /// Takes memory for a state; `None` where there is none.
    fn hold(&self, state: &SessionState) -> Option<Charge> {
        let bytes = state.session_bytes();
        let held = self.memory.hold(bytes);
        if held.is_none() && self.evicts {
            self.evict();
            return self.memory.hold(bytes);
        }
        held
    }

    /// Removes the sessions whose last use is longest ago. Those in use, or without a record in the store, stay. The
    /// removed ones live on in the store.
    fn evict(&self) {
        let idle = |session: &&Arc<Session>| !session.is_busy() && session.version().is_some();
        let mut oldest: Vec<(Duration, Uuid)> = {
            let sessions = lock(&self.sessions);
            let idle = sessions.values().filter(idle);
            idle.map(|session| (session.expires(), session.id()))
                .collect()
        };
        let count = oldest.len().div_ceil(EVICTED);
        oldest.sort_unstable();
        for (_, id) in oldest.into_iter().take(count) {
            // The session may be in use by now, or another one may have its id. It is freed after the lock is released.
            let _evicted = match lock(&self.sessions).entry(id) {
                Entry::Occupied(entry) if idle(&entry.get()) => Some(entry.remove()),
                _ => None,
            };
        }
    }
}
