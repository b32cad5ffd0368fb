//! The map of live sessions. Its lock is held for a look-up only: no work is done and no session is freed under it.

use super::clock::Clock;
use super::expired::ExpiredIds;
use super::scheduler::budget::Budget;
use super::session::{Lease, Owner, Session};
use super::store::SessionName;
use super::sync::{Mutex, lock};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;
use std::time::SystemTime;
use uuid::Uuid;

/// The service holds as many sessions as it may; try again later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("there are {0} sessions, which is the maximum")]
pub struct TooManySessions(pub usize);

/// Why there is no session for a client under an id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoSession {
    /// The id never had a session, or its session was ended, or it belongs to another client.
    #[error("there is no such session")]
    Unknown,
    /// No frame came for too long.
    #[error("the session has expired")]
    Expired,
    /// The store has no record of the session, though its time to live was not over.
    #[error("the store has lost the session")]
    Lost,
}

/// The live sessions.
#[derive(Debug)]
pub struct Registry {
    pub(super) sessions: Mutex<HashMap<Uuid, Arc<Session>>>,
    pub(super) max_sessions: usize,
    /// Whether sessions that the store has are removed from memory where there is no room.
    pub(super) evicts: bool,
    /// Ids of expired sessions. Locked for a moment only, and never together with the map.
    expired: Mutex<ExpiredIds>,
    pub(super) max_requests: usize,
    pub(super) lease: Lease,
    pub(super) clock: Clock,
    pub(super) memory: Budget,
}

impl Registry {
    /// A registry of at most `max_sessions` sessions, each with at most `max_requests` requests at once. A session
    /// expires when no frame comes within its lease.
    pub fn new(max_sessions: usize, max_requests: usize, lease: Lease, clock: Clock) -> Self {
        Self {
            sessions: Mutex::default(),
            expired: Mutex::default(),
            max_sessions,
            evicts: false,
            max_requests,
            lease,
            clock,
            memory: Budget::new(usize::MAX),
        }
    }

    /// Bounds the states of all sessions together to `bytes` bytes.
    pub fn with_memory(mut self, bytes: usize) -> Self {
        self.memory = Budget::new(bytes);
        self
    }

    /// Lets sessions that are not in use, and that a store has, be removed from memory where there is no room.
    pub fn with_eviction(mut self) -> Self {
        self.evicts = true;
        self
    }

    /// The error for want of room for one more session.
    pub(super) fn full(&self) -> TooManySessions {
        TooManySessions(self.max_sessions)
    }

    /// Whether there is room for one more session, after the expired ones have gone.
    ///
    /// # Errors
    /// There is no room.
    pub fn check_room(&self) -> Result<(), TooManySessions> {
        if self.len() >= self.max_sessions {
            self.sweep();
        }
        if self.len() >= self.max_sessions && !self.evicts {
            return Err(self.full());
        }
        Ok(())
    }

    /// The live session of this id, whoever it belongs to.
    pub fn live(&self, id: Uuid) -> Option<Arc<Session>> {
        let session = lock(&self.sessions).get(&id).cloned();
        session.filter(|session| !self.has_ended(session))
    }

    /// The live session of this id and owner. This does not extend the session's life.
    ///
    /// # Errors
    /// See [`NoSession`]. Another owner's session counts as unknown.
    pub fn find(&self, id: Uuid, owner: &Owner) -> Result<Arc<Session>, NoSession> {
        let ended = {
            let mut sessions = lock(&self.sessions);
            match sessions.get(&id) {
                Some(session) if session.owner() != owner => return Err(NoSession::Unknown),
                Some(session) if !self.has_ended(session) => return Ok(session.clone()),
                _ => sessions.remove(&id),
            }
        };
        // The lock has been released: this may free the session.
        if let Some(ended) = ended {
            self.end(&ended);
        }
        match lock(&self.expired).contains(id, owner, self.clock.now()) {
            true => Err(NoSession::Expired),
            false => Err(NoSession::Unknown),
        }
    }

    /// Whether the session of this id lives, whoever it belongs to.
    pub fn is_live(&self, id: Uuid) -> bool {
        self.live(id).is_some()
    }

    /// Ends a session. Work that has begun on it still gets its answer; requests that wait for it do not. False if
    /// there is no such session. Another session that has its id by now stays.
    pub fn remove(&self, name: SessionName) -> bool {
        let removed = match lock(&self.sessions).entry(name.id) {
            Entry::Occupied(entry) if entry.get().name() == name => Some(entry.remove()),
            _ => None,
        };
        let Some(session) = removed else { return false };
        let live = !self.has_ended(&session);
        session.close();
        live
    }

    /// Removes this session from memory, unless another one has its id by now. It may live on in the store.
    pub fn forget(&self, session: &Arc<Session>) {
        // The session is freed after the lock is released.
        let _forgotten = match lock(&self.sessions).entry(session.id()) {
            Entry::Occupied(entry) if Arc::ptr_eq(entry.get(), session) => Some(entry.remove()),
            _ => None,
        };
    }

    /// Removes the sessions that have expired. Returns their number.
    pub fn sweep(&self) -> usize {
        let ended: Vec<Arc<Session>> = {
            let mut sessions = lock(&self.sessions);
            let ended = sessions.extract_if(|_, session| self.has_ended(session));
            ended.map(|(_, session)| session).collect()
        };
        ended.iter().for_each(|session| self.end(session));
        ended.len()
    }

    /// All sessions in the map.
    pub fn all(&self) -> Vec<Arc<Session>> {
        lock(&self.sessions).values().cloned().collect()
    }

    /// Number of sessions in the map, those included that have expired since the last sweep.
    pub fn len(&self) -> usize {
        lock(&self.sessions).len()
    }

    /// Whether there are no sessions.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The wall-clock time at which the session expires when it is not used again.
    pub fn expires_at(&self, session: &Session) -> SystemTime {
        self.clock.wall(session.expires())
    }

    pub(super) fn has_ended(&self, session: &Session) -> bool {
        // A request renews the session before it gives its permit back. So the expiry is read after the permits.
        let is_busy = session.is_busy();
        session.is_closed() || (!is_busy && self.clock.now() >= session.expires())
    }

    /// Closes a session that has ended and is no longer in the map.
    fn end(&self, session: &Session) {
        if !session.is_closed() {
            let (owner, now) = (session.owner().clone(), self.clock.now());
            lock(&self.expired).note(session.id(), owner, now);
        }
        session.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Admission, Fingerprint, Flow, InsertError, NewSession, PerTarget, SessionState, Version,
        WorkerSlot,
    };
    use bagtrack_tracker::{Frame, Preset, Rect};
    use std::sync::mpsc;
    use std::time::Duration;

    const IDLE: Duration = Duration::from_secs(600);
    const LEASE: Lease = Lease {
        first: IDLE,
        idle: IDLE,
    };

    fn insert(registry: &Registry) -> Arc<Session> {
        registry.insert(new_session(registry)).unwrap()
    }

    fn new_session(registry: &Registry) -> NewSession {
        let luma = (0..64 * 48).map(|i| (i * 7 % 251) as u8).collect();
        let frame = Frame::from_luma(64, 48, luma).unwrap();
        let target = Rect::new(10.0, 10.0, 20.0, 16.0);
        let (print, params) = (Fingerprint::of(b"first"), Preset::Paper.params());
        let state = SessionState::start(
            &frame,
            print,
            &PerTarget::One(target),
            &params,
            None,
            || Ok(()),
        )
        .unwrap();
        NewSession {
            id: crate::random::new_id(),
            opening: registry.opening([0; 32], &state),
            owner: Owner::default(),
            version: None,
            ttl: registry.first_lease(),
            state,
            held: Box::new(()),
        }
    }

    #[test]
    fn where_a_store_has_the_sessions_the_one_that_was_not_used_for_longest_makes_room() {
        let (clock, version) = (Clock::default(), Some(Version::first(0)));
        let registry = Registry::new(2, 9, LEASE, clock.clone()).with_eviction();
        let old = insert(&registry);
        clock.advance(Duration::from_secs(1));
        let newer = insert(&registry);
        // The store has neither session, so neither may be removed.
        let full = registry.insert(new_session(&registry)).unwrap_err();
        assert_eq!(full, InsertError::Full(TooManySessions(2)));
        old.set_version(version);
        newer.set_version(version);
        let permit = old.enter().unwrap();
        let third = insert(&registry);
        assert!(registry.is_live(old.id()), "it is in use");
        assert!(!registry.is_live(newer.id()) && registry.len() == 2);
        assert!(!newer.is_closed(), "it lives in the store");
        drop(permit);
        third.set_version(version);
        insert(&registry);
        assert!(!registry.is_live(old.id()) && registry.is_live(third.id()));
        assert_eq!(registry.len(), 2);

        // The same holds where there is no memory for another state.
        let bytes = third.params().session_bytes();
        let registry = Registry::new(9, 9, LEASE, clock).with_eviction();
        let registry = registry.with_memory(bytes);
        let first = insert(&registry);
        assert!(registry.insert(new_session(&registry)).is_err());
        first.set_version(version);
        let id = first.id();
        drop(first);
        insert(&registry);
        assert!(!registry.is_live(id) && registry.len() == 1);
    }

    #[test]
    fn an_id_is_taken_until_its_session_has_ended() {
        let clock = Clock::default();
        let registry = Registry::new(2, 9, LEASE, clock.clone());
        let session = insert(&registry);
        let again = || NewSession {
            id: session.id(),
            ..new_session(&registry)
        };
        assert_eq!(registry.insert(again()).unwrap_err(), InsertError::Taken);
        clock.advance(IDLE);
        let other = registry.insert(again()).unwrap();
        assert!(session.is_closed() && !other.is_closed());
        // Calls for the former session do not change its successor.
        registry.forget(&session);
        assert!(!registry.remove(session.name()));
        assert!(registry.is_live(other.id()));
        registry.forget(&other);
        assert!(registry.is_empty() && !other.is_closed());
    }

    /// A session in a new registry, which notes whether the map's lock was free when the session was freed.
    fn watched() -> (Arc<Registry>, Clock, SessionName, mpsc::Receiver<bool>) {
        let clock = Clock::default();
        let registry = Arc::new(Registry::new(9, 9, LEASE, clock.clone()));
        let session = insert(&registry);
        let (freed, was_free) = mpsc::channel();
        let map = registry.clone();
        let probe = move || freed.send(map.sessions.try_lock().is_ok()).unwrap();
        *session.on_drop.lock().unwrap() = Some(Box::new(probe));
        (registry, clock, session.name(), was_free)
    }

    #[test]
    fn no_session_is_freed_under_the_lock_of_the_map() {
        let (registry, clock, SessionName { id, .. }, was_free) = watched();
        clock.advance(IDLE);
        let owner = Owner::default();
        assert_eq!(registry.find(id, &owner).unwrap_err(), NoSession::Expired);
        assert_eq!(was_free.try_recv(), Ok(true), "when it is looked up");

        let (registry, _, name, was_free) = watched();
        assert!(registry.remove(name));
        assert_eq!(was_free.try_recv(), Ok(true), "when it is removed");

        let (registry, clock, SessionName { id, .. }, was_free) = watched();
        clock.advance(IDLE);
        assert_eq!(registry.sweep(), 1);
        assert_eq!(was_free.try_recv(), Ok(true), "when it is swept");
        let swept = registry.find(id, &Owner::default());
        assert_eq!(swept.unwrap_err(), NoSession::Expired);
    }

    #[tokio::test]
    async fn a_session_whose_work_panicked_has_ended() {
        let registry = Registry::new(9, 9, LEASE, Clock::default());
        let session = insert(&registry);
        let mut locked = session.enter().unwrap().lock().await.unwrap();
        let waiting = session.enter().unwrap();
        let admission = Admission::new(9, 1, Duration::ZERO).unwrap();
        let work = move |_: &mut WorkerSlot| {
            let _state = locked.state();
            panic!("a test panics in the work");
        };
        let place = admission.enter(Flow(0), Box::new(())).unwrap();
        let panicked: Result<(), _> = admission.run(place, work).await;
        assert!(panicked.is_err());
        assert!(waiting.lock().await.is_err(), "those who wait are told");
        let found = registry.find(session.id(), &Owner::default());
        assert_eq!(found.unwrap_err(), NoSession::Unknown);
        assert!(registry.is_empty());
    }
}
