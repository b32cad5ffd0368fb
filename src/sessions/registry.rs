//! The map of live sessions. Its lock is held for a look-up only: no work is done and no session is freed under it.

use super::admission::Held;
use super::byte_budget::ByteBudget;
use super::clock::Clock;
use super::session::Session;
use super::state::SessionState;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};
use uuid::Uuid;

/// The service holds as many sessions as it may; try again later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("there are {0} sessions, which is the maximum")]
pub struct TooManySessions(pub usize);

/// The live sessions.
#[derive(Debug)]
pub struct Registry {
    sessions: Mutex<HashMap<Uuid, Arc<Session>>>,
    max_sessions: usize,
    max_requests: usize,
    idle: Duration,
    clock: Clock,
    memory: ByteBudget,
}

impl Registry {
    /// At most `max_sessions` sessions, each with at most `max_requests` requests at once. A session expires when it
    /// was not used for `idle`.
    pub fn new(max_sessions: usize, max_requests: usize, idle: Duration, clock: Clock) -> Self {
        Self {
            sessions: Mutex::default(),
            max_sessions,
            max_requests,
            idle,
            clock,
            memory: ByteBudget::new(usize::MAX),
        }
    }

    /// The states of all sessions together take at most so many bytes.
    pub fn with_memory(mut self, bytes: usize) -> Self {
        self.memory = ByteBudget::new(bytes);
        self
    }

    /// Whether there is room for one more session, after the expired ones have gone.
    ///
    /// # Errors
    /// There is none.
    pub fn check_room(&self) -> Result<(), TooManySessions> {
        if self.len() >= self.max_sessions {
            self.sweep();
        }
        if self.len() >= self.max_sessions {
            return Err(TooManySessions(self.max_sessions));
        }
        Ok(())
    }

    /// Adds a session under a new id. It keeps `held` until it is freed.
    ///
    /// # Errors
    /// There is no room, or no memory for a state with its parameters.
    pub fn insert(&self, state: SessionState, held: Held) -> Result<Arc<Session>, TooManySessions> {
        self.check_room()?;
        let memory = self.memory.hold(state.tracker().params().session_bytes());
        let memory = memory.ok_or(TooManySessions(self.max_sessions))?;
        let held: Held = Box::new((held, memory));
        let session = Session::new(state, held, self.max_requests, self.clock.clone());
        let mut sessions = self.map();
        if sessions.len() >= self.max_sessions {
            return Err(TooManySessions(self.max_sessions));
        }
        sessions.insert(session.id(), session.clone());
        Ok(session)
    }

    /// The live session of this id. This counts as use.
    pub fn get(&self, id: Uuid) -> Option<Arc<Session>> {
        let ended = {
            let mut sessions = self.map();
            let session = sessions.get(&id)?.clone();
            if !self.has_ended(&session) {
                session.touch();
                return Some(session);
            }
            sessions.remove(&id);
            session
        };
        // The lock has been released: this may free the session.
        ended.close();
        None
    }

    /// Ends a session. Work that has begun on it still gets its answer; requests that wait for it do not. False if
    /// there is no such session.
    pub fn remove(&self, id: Uuid) -> bool {
        let removed = self.map().remove(&id);
        let Some(session) = removed else { return false };
        let live = !self.has_ended(&session);
        session.close();
        live
    }

    /// Removes the sessions that have expired. Returns their number.
    pub fn sweep(&self) -> usize {
        let mut ended = Vec::new();
        self.map().retain(|_, session| {
            let keep = !self.has_ended(session);
            if !keep {
                session.close();
                ended.push(session.clone());
            }
            keep
        });
        ended.len()
    }

    /// Number of sessions in the map, those included that have expired since the last sweep.
    pub fn len(&self) -> usize {
        self.map().len()
    }

    /// Whether there are no sessions.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The wall-clock time at which the session expires when it is not used again.
    pub fn expires_at(&self, session: &Session) -> SystemTime {
        self.clock.wall(session.last_used() + self.idle)
    }

    fn has_ended(&self, session: &Session) -> bool {
        let expired = self.clock.now() >= session.last_used() + self.idle;
        session.is_closed() || (expired && !session.is_busy())
    }

    fn map(&self) -> MutexGuard<'_, HashMap<Uuid, Arc<Session>>> {
        // Nothing panics while it is held; were it so, the map itself would still be whole.
        self.sessions.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sessions::{Admission, Fingerprint, Lane, Turn};
    use crate::tracker::{GrayFrame, Preset, Rect, Tracker};
    use std::sync::mpsc;

    const IDLE: Duration = Duration::from_secs(600);

    fn state() -> SessionState {
        let luma = (0..64 * 48).map(|i| (i * 7 % 251) as u8).collect();
        let frame = GrayFrame::from_luma(64, 48, luma).unwrap();
        let target = Rect {
            x: 10.0,
            y: 10.0,
            width: 20.0,
            height: 16.0,
        };
        let tracker = Tracker::new(&frame, target, Preset::Paper.params()).unwrap();
        SessionState::new(tracker, Fingerprint::of(b"first"), target)
    }

    /// A session in a new registry, which notes whether the map's lock was free when the session was freed.
    fn watched() -> (Arc<Registry>, Clock, Uuid, mpsc::Receiver<bool>) {
        let clock = Clock::default();
        let registry = Arc::new(Registry::new(9, 9, IDLE, clock.clone()));
        let session = registry.insert(state(), Box::new(())).unwrap();
        let (freed, was_free) = mpsc::channel();
        let map = registry.clone();
        let probe = move || freed.send(map.sessions.try_lock().is_ok()).unwrap();
        *session.on_drop.lock().unwrap() = Some(Box::new(probe));
        (registry, clock, session.id(), was_free)
    }

    #[test]
    fn no_session_is_freed_under_the_lock_of_the_map() {
        let (registry, clock, id, was_free) = watched();
        clock.advance(IDLE);
        assert!(registry.get(id).is_none());
        assert_eq!(was_free.try_recv(), Ok(true), "when it is looked up");

        let (registry, _, id, was_free) = watched();
        assert!(registry.remove(id));
        assert_eq!(was_free.try_recv(), Ok(true), "when it is removed");

        let (registry, clock, _, was_free) = watched();
        clock.advance(IDLE);
        assert_eq!(registry.sweep(), 1);
        assert_eq!(was_free.try_recv(), Ok(true), "when it is swept");
    }

    #[tokio::test]
    async fn a_session_whose_work_panicked_has_ended() {
        let registry = Registry::new(9, 9, IDLE, Clock::default());
        let session = registry.insert(state(), Box::new(())).unwrap();
        let mut locked = session.enter().unwrap().lock().await.unwrap();
        let waiting = session.enter().unwrap();
        let admission = Admission::new(9, 1);
        let work = move |_: &mut Turn| {
            let _state = locked.state();
            panic!("a test panics in the work");
        };
        let place = admission.enter(Lane(0), Box::new(())).unwrap();
        let panicked: Result<(), _> = admission.run(place, work).await;
        assert!(panicked.is_err());
        assert!(waiting.lock().await.is_err(), "those who wait are told");
        assert!(registry.get(session.id()).is_none());
        assert!(registry.is_empty());
    }
}
