//! The permits of requests to a session, and the exclusive use of its state.
//!
//! A request first takes one of a few permits ([`Session::enter`]), then the lock ([`SessionPermit::lock`]), and moves
//! the [`LockedSession`] into the work on a worker thread. The lock is fair: requests are served in the order in which
//! they asked for it.

use super::session::Session;
use super::state::SessionState;
use super::store::Version;
use super::sync::atomic::Ordering;
use crate::clock::timeout;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{OwnedMutexGuard, OwnedSemaphorePermit};

/// How many frames a numbered frame may be ahead of its turn.
const MAX_EARLY: u64 = 16;

/// All permits of the session are taken; try again later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("too many requests wait for the session")]
pub struct SessionBusy;

/// The session was ended while the request waited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the session has ended")]
pub struct SessionClosed;

impl Session {
    /// Takes a permit of the session, for frames. The permit alone does not extend the session's life.
    ///
    /// # Errors
    /// All permits are taken.
    pub fn enter(self: &Arc<Self>) -> Result<SessionPermit, SessionBusy> {
        let permit = self.permits.clone().try_acquire_owned();
        Ok(self.frames_permit(permit.map_err(|_| SessionBusy)?))
    }

    /// Takes a permit of the session for frames, and waits for it in order of arrival. An ended session gives permits,
    /// too.
    pub async fn enter_in_order(self: &Arc<Self>) -> SessionPermit {
        let permit = self.permits.clone().acquire_owned().await;
        let permit = permit.expect("the permits are never closed");
        self.frames_permit(permit)
    }

    fn frames_permit(self: &Arc<Self>, permit: OwnedSemaphorePermit) -> SessionPermit {
        SessionPermit {
            session: self.clone(),
            has_frames: true,
            overlaps: self.frame_requests.fetch_add(1, Ordering::AcqRel) > 0,
            permit: Arc::new(permit),
        }
    }

    /// Takes a permit of the session, to read its state.
    ///
    /// # Errors
    /// All permits are taken.
    pub fn read_permit(self: &Arc<Self>) -> Result<SessionPermit, SessionBusy> {
        let permit = self.permits.clone().try_acquire_owned();
        let permit = permit.map_err(|_| SessionBusy)?;
        Ok(SessionPermit {
            session: self.clone(),
            has_frames: false,
            overlaps: false,
            permit: Arc::new(permit),
        })
    }
}

/// A permit for one request to a session, which does not expire meanwhile. Given back when the last clone by
/// [`share`](Self::share) is dropped.
#[derive(Debug)]
pub struct SessionPermit {
    session: Arc<Session>,
    has_frames: bool,
    overlaps: bool,
    permit: Arc<OwnedSemaphorePermit>,
}

impl SessionPermit {
    /// The session.
    pub fn session(&self) -> &Arc<Session> {
        &self.session
    }

    /// The same permit again, to read the session before the frames' turn.
    pub fn share(&self) -> Self {
        Self {
            session: self.session.clone(),
            has_frames: false,
            overlaps: false,
            permit: self.permit.clone(),
        }
    }

    /// Whether another request with frames had a permit when this one came.
    pub fn overlaps(&self) -> bool {
        self.overlaps
    }

    /// Whether frame `number` comes before its turn, by at most 16 frames.
    pub fn is_early(&self, number: u64) -> bool {
        let early = number.saturating_sub(self.session.latest_frame() + 1);
        (1..=MAX_EARLY).contains(&early)
    }

    /// Whether an early frame may wait for its turn: the last free permit of the session is left to the frame whose
    /// turn it is.
    pub fn may_wait(&self) -> bool {
        self.session.permits.available_permits() > 0
    }

    /// Waits for the turn of frame `number` if it [is early](Self::is_early), at most for `patience`.
    pub async fn wait_for_turn(&self, number: u64, patience: Duration) {
        if !self.is_early(number) {
            return;
        }
        let mut latest = self.session.latest.subscribe();
        let turn = latest.wait_for(|latest| latest.first().frame + 1 >= number);
        // A frame that is still early is refused later because of its number.
        let _ = timeout(patience, turn).await;
    }

    /// Waits for the session, in order of arrival.
    ///
    /// # Errors
    /// The session was ended in the meantime.
    pub async fn lock(self) -> Result<LockedSession, SessionClosed> {
        let state = self.session.state.clone().lock_owned().await;
        if self.session.is_closed() {
            return Err(SessionClosed);
        }
        Ok(LockedSession {
            state,
            permit: self,
        })
    }
}

impl Drop for SessionPermit {
    fn drop(&mut self) {
        if self.has_frames {
            self.session.frame_requests.fetch_sub(1, Ordering::AcqRel);
        }
    }
}

/// A session whose state one request uses exclusively.
#[derive(Debug)]
pub struct LockedSession {
    state: OwnedMutexGuard<SessionState>,
    permit: SessionPermit,
}

impl LockedSession {
    /// The session.
    pub fn session(&self) -> &Arc<Session> {
        self.permit.session()
    }

    /// The state.
    pub fn state(&mut self) -> &mut SessionState {
        &mut self.state
    }

    /// Replaces the state by one that goes on from this version of the record in the store.
    pub fn replace(&mut self, state: SessionState, version: Option<Version>) {
        *self.state = state;
        self.session().set_version(version);
    }

    /// Notes that this request began the next generation of the record in the store.
    pub fn fenced(&self) {
        let version = self.session().version();
        self.session().set_version(version.map(Version::fenced));
    }
}

impl Drop for LockedSession {
    fn drop(&mut self) {
        let session = self.permit.session();
        if std::thread::panicking() {
            // A tracker that panicked half-way through a frame is in no defined state.
            session.close();
            return;
        }
        session.latest.send_replace(self.state.latest());
    }
}
