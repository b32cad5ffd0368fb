//! One session: a tracker behind a lock that is taken in order of arrival.
//!
//! A request first takes one of a few permits ([`Session::enter`]), then the lock ([`SessionPermit::lock`]), and moves
//! the [`LockedSession`] into the work on a worker thread. The lock is fair: requests are served in the order in which
//! they asked for it.

use super::admission::Held;
use super::clock::Clock;
use super::owner::Owner;
use super::short_id::short_id;
use super::state::SessionState;
use crate::tracker::{Estimate, FrameFormat, Params};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;
use tokio::sync::{Mutex as AsyncMutex, OwnedMutexGuard, OwnedSemaphorePermit, Semaphore, watch};
use tokio::time::timeout;
use uuid::Uuid;

/// How many frames a numbered one may be ahead of its turn.
const MAX_EARLY: u64 = 16;

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
    /// The last answer, to be read and waited for without the lock.
    latest: watch::Sender<Estimate>,
    /// Requests with frames at this session.
    frame_requests: AtomicUsize,
    clock: Clock,
    idle: Duration,
    /// When the session expires, by its clock.
    expires_ms: AtomicU64,
    closed: AtomicBool,
    /// Called when the session is freed.
    #[cfg(test)]
    pub(super) on_drop: std::sync::Mutex<Option<Box<dyn FnOnce() + Send>>>,
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
        let on_drop = self.on_drop.get_mut().expect("no probe panics");
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
            latest: watch::Sender::new(state.tracker().estimate()),
            frame_requests: AtomicUsize::new(0),
            state: Arc::new(AsyncMutex::new(state)),
            permits: Arc::new(Semaphore::new(max_requests)),
            max_requests,
            _held: held,
            clock,
            idle: lease.idle,
            expires_ms: AtomicU64::new(milliseconds(first)),
            closed: AtomicBool::new(false),
            #[cfg(test)]
            on_drop: std::sync::Mutex::default(),
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
        *self.latest.borrow()
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

    /// Takes a permit of the session, for frames. That alone does not keep the session alive for longer.
    ///
    /// # Errors
    /// All permits are taken.
    pub fn enter(self: &Arc<Self>) -> Result<SessionPermit, SessionBusy> {
        let mut permit = self.visit()?;
        permit.has_frames = true;
        permit.overlaps = self.frame_requests.fetch_add(1, Ordering::AcqRel) > 0;
        Ok(permit)
    }

    /// Takes a permit of the session, to look at it.
    ///
    /// # Errors
    /// All permits are taken.
    pub fn visit(self: &Arc<Self>) -> Result<SessionPermit, SessionBusy> {
        let permit = self.permits.clone().try_acquire_owned();
        Ok(SessionPermit {
            session: self.clone(),
            has_frames: false,
            overlaps: false,
            _permit: permit.map_err(|_| SessionBusy)?,
        })
    }
}

fn milliseconds(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

/// A permit to be at a session, which does not expire meanwhile. Given back when it is dropped.
#[derive(Debug)]
pub struct SessionPermit {
    session: Arc<Session>,
    has_frames: bool,
    overlaps: bool,
    _permit: OwnedSemaphorePermit,
}

impl SessionPermit {
    /// The session.
    pub fn session(&self) -> &Arc<Session> {
        &self.session
    }

    /// Whether another request with frames was at the session when this one came.
    pub fn overlaps(&self) -> bool {
        self.overlaps
    }

    /// Waits for the turn of frame `number` where it comes a little early, at most so long. The last free place of the
    /// session is left to the frame whose turn it is.
    pub async fn wait_for_turn(&self, number: u64, patience: Duration) {
        let session = &self.session;
        let early = number.saturating_sub(session.latest().frame + 1);
        if !(1..=MAX_EARLY).contains(&early) || session.permits.available_permits() == 0 {
            return;
        }
        let mut latest = session.latest.subscribe();
        let turn = latest.wait_for(|latest| latest.frame + 1 >= number);
        // Whoever came too early is told so by its number.
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
        session.latest.send_replace(latest);
    }
}
