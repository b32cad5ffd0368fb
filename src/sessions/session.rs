//! One session: a tracker behind a lock that is taken in order of arrival.
//!
//! A request first takes one of a few permits ([`Session::enter`]), then the lock ([`SessionPermit::lock`]), and moves
//! the [`LockedSession`] into the work on a worker thread. The lock is fair: requests are served in the order in which
//! they asked for it.

use super::admission::Held;
use super::clock::Clock;
use super::owner::Owner;
use super::state::SessionState;
use crate::tracker::{Estimate, FrameFormat, Params};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::sync::{Mutex as AsyncMutex, OwnedMutexGuard, OwnedSemaphorePermit, Semaphore};
use uuid::Uuid;

/// All permits of the session are taken; try again later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("too many requests wait for the session")]
pub struct SessionBusy;

/// The session was ended while the request waited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the session has ended")]
pub struct SessionClosed;

/// How long a session lives without use.
#[derive(Debug, Clone, Copy)]
pub struct Lease {
    /// From its opening to its first frame.
    pub first: Duration,
    /// After each frame.
    pub idle: Duration,
}

/// One session.
#[cfg_attr(not(test), derive(Debug))]
pub struct Session {
    id: Uuid,
    owner: Owner,
    source_size: (u32, u32),
    frame_format: FrameFormat,
    params: Params,
    state: Arc<AsyncMutex<SessionState>>,
    /// The permits that are free. Each request at this session has one, the one at work included.
    permits: Arc<Semaphore>,
    max_requests: usize,
    /// The place of the session in its client's quota.
    _held: Held,
    /// The last answer, to be read without waiting for the lock.
    latest: Mutex<Estimate>,
    clock: Clock,
    idle: Duration,
    /// When the session expires, by its clock.
    expires_ms: AtomicU64,
    closed: AtomicBool,
    /// Called when the session is freed.
    #[cfg(test)]
    pub(super) on_drop: Mutex<Option<Box<dyn FnOnce() + Send>>>,
}

#[cfg(test)]
impl std::fmt::Debug for Session {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "Session({})", self.id)
    }
}

#[cfg(test)]
impl Drop for Session {
    fn drop(&mut self) {
        let on_drop = self
            .on_drop
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner);
        on_drop.take().into_iter().for_each(|probe| probe());
    }
}

impl Session {
    pub(super) fn new(
        state: SessionState,
        owner: Owner,
        held: Held,
        max_requests: usize,
        lease: Lease,
        clock: Clock,
    ) -> Arc<Self> {
        let first = clock.now() + lease.first.min(lease.idle);
        Arc::new(Self {
            id: Uuid::new_v4(),
            owner,
            source_size: state.tracker().source_size(),
            frame_format: state.tracker().frame_format(),
            params: state.tracker().params().clone(),
            latest: Mutex::new(state.tracker().estimate()),
            state: Arc::new(AsyncMutex::new(state)),
            permits: Arc::new(Semaphore::new(max_requests)),
            max_requests,
            _held: held,
            clock,
            idle: lease.idle,
            expires_ms: AtomicU64::new(milliseconds(first)),
            closed: AtomicBool::new(false),
            #[cfg(test)]
            on_drop: Mutex::default(),
        })
    }

    /// The session's id.
    pub fn id(&self) -> Uuid {
        self.id
    }

    /// How the session sees its frames.
    pub fn frame_format(&self) -> FrameFormat {
        self.frame_format
    }

    /// The beginning of the id, for the log: whoever reads it cannot use the session.
    pub fn short_id(&self) -> String {
        short_id(self.id)
    }

    /// Whose the session is.
    pub fn owner(&self) -> &Owner {
        &self.owner
    }

    /// Width and height of the session's frames as uploaded.
    pub fn source_size(&self) -> (u32, u32) {
        self.source_size
    }

    /// The tracker's parameters.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// The last answer.
    pub fn latest(&self) -> Estimate {
        *self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// When the session expires unless a frame comes, by its clock.
    pub fn expires(&self) -> Duration {
        Duration::from_millis(self.expires_ms.load(Ordering::Relaxed))
    }

    /// The session expires an idle time from now: a frame was taken, or only the service is to blame that it was not.
    pub fn renew(&self) {
        let expires = milliseconds(self.clock.now() + self.idle);
        self.expires_ms.fetch_max(expires, Ordering::Relaxed);
    }

    /// Whether a request is at the session.
    pub fn is_busy(&self) -> bool {
        self.permits.available_permits() < self.max_requests
    }

    /// Whether the session has ended.
    pub fn is_closed(&self) -> bool {
        self.closed.load(Ordering::Acquire)
    }

    pub(super) fn close(&self) {
        self.closed.store(true, Ordering::Release);
    }

    /// Takes a permit of the session. That alone does not keep the session alive for longer.
    ///
    /// # Errors
    /// All permits are taken.
    pub fn enter(self: &Arc<Self>) -> Result<SessionPermit, SessionBusy> {
        let permit = self.permits.clone().try_acquire_owned();
        Ok(SessionPermit {
            session: self.clone(),
            _permit: permit.map_err(|_| SessionBusy)?,
        })
    }
}

/// The beginning of an id, for the log.
pub fn short_id(id: Uuid) -> String {
    let mut text = id.simple().to_string();
    text.truncate(8);
    text.push('…');
    text
}

fn milliseconds(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

/// A permit to be at a session, which does not expire meanwhile. Given back when it is dropped.
#[derive(Debug)]
pub struct SessionPermit {
    session: Arc<Session>,
    _permit: OwnedSemaphorePermit,
}

impl SessionPermit {
    /// The session.
    pub fn session(&self) -> &Arc<Session> {
        &self.session
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

/// A session whose state belongs to one request.
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
}

impl Drop for LockedSession {
    fn drop(&mut self) {
        let session = self.permit.session();
        if std::thread::panicking() {
            // A tracker that panicked half-way through a frame is in no defined state.
            session.close();
            return;
        }
        let latest = self.state.tracker().estimate();
        *session
            .latest
            .lock()
            .unwrap_or_else(PoisonError::into_inner) = latest;
    }
}
