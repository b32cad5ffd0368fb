//! One session: whose it is and how it was opened, what it is made of, its trackers behind a lock, and what can be read
//! of it without the lock.

use super::clock::Clock;
use super::scheduler::queue_permit::Reservation;
use super::state::SessionState;
use super::store::{SessionName, Version};
use super::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use super::sync::{Mutex, lock};
use super::targets::Estimates;
use bagtrack_tracker::Params;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Mutex as AsyncMutex, Semaphore, watch};
use uuid::Uuid;

/// The client that a session belongs to: the name of its API key, or nobody where the service has no keys. Other
/// clients do not see the session.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct Owner(Option<Arc<str>>);

impl Owner {
    /// The client whose API key has this name.
    pub fn named(name: &str) -> Self {
        Self(Some(name.into()))
    }

    /// The name of the API key.
    pub fn name(&self) -> Option<&str> {
        self.0.as_deref()
    }
}

/// How a session was opened. A request that opens it again is compared with this, and gets the same answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Opening {
    /// Digest of the request's frame and settings.
    pub request: [u8; 32],
    /// The answer: that of frame 0, or of the snapshot's frame.
    pub estimates: Estimates,
    /// When the session expires without a frame, as its opening request was told: in seconds since 1970.
    pub expires: u64,
    /// A random number, which tells apart sessions that had one id after the other.
    pub incarnation: u64,
}

/// How long a session lives without use.
#[derive(Debug, Clone, Copy)]
pub struct Lease {
    /// From its opening to its first frame.
    pub first: Duration,
    /// After each frame.
    pub idle: Duration,
}

/// The parts of which a session is made.
pub struct NewSession {
    /// Its id: the client's own, or a random one.
    pub id: Uuid,
    /// How it was opened.
    pub opening: Opening,
    /// The session's owner.
    pub owner: Owner,
    /// The version of the record in the store that `state` is; `None` where there is no store.
    pub version: Option<Version>,
    /// The session expires after this time without a frame.
    pub ttl: Duration,
    /// The trackers and the last answers.
    pub state: SessionState,
    /// What is held until the session is freed, such as its place in a quota.
    pub held: Reservation,
}

/// One session.
#[cfg_attr(not(test), derive(Debug))]
pub struct Session {
    id: Uuid,
    owner: Owner,
    opening: Opening,
    source_size: (u32, u32),
    target_count: usize,
    params: Params,
    pub(super) state: Arc<AsyncMutex<SessionState>>,
    /// The free permits. Each request to this session has a permit, the one at work included.
    pub(super) permits: Arc<Semaphore>,
    max_requests: usize,
    /// The place of the session in its client's quota.
    _held: Reservation,
    /// The last answer, to be read and waited for without the lock.
    pub(super) latest: watch::Sender<Estimates>,
    /// Requests to this session that bring frames.
    pub(super) frame_requests: AtomicUsize,
    /// Which version of the record in the store the state goes on from. It changes under the lock of the state.
    version: Mutex<Option<Version>>,
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
        let on_drop = self.on_drop.get_mut().expect("no probe panics");
        on_drop.take().into_iter().for_each(|probe| probe());
    }
}

impl Session {
    pub(super) fn new(
        new: NewSession,
        max_requests: usize,
        lease: Lease,
        clock: Clock,
    ) -> Arc<Self> {
        let NewSession {
            id,
            opening,
            owner,
            version,
            ttl,
            state,
            held,
        } = new;
        let expires = clock.now() + ttl;
        Arc::new(Self {
            id,
            owner,
            opening,
            source_size: state.source_size(),
            target_count: state.target_count(),
            params: state.params().clone(),
            latest: watch::Sender::new(state.latest()),
            frame_requests: AtomicUsize::new(0),
            version: Mutex::new(version),
            state: Arc::new(AsyncMutex::new(state)),
            permits: Arc::new(Semaphore::new(max_requests)),
            max_requests,
            _held: held,
            clock,
            idle: lease.idle,
            expires_ms: AtomicU64::new(milliseconds(expires)),
            closed: AtomicBool::new(false),
            #[cfg(test)]
            on_drop: Mutex::default(),
        })
    }

    /// The session's id.
    pub fn id(&self) -> Uuid {
        self.id
    }

    /// The beginning of the id, for the log: whoever reads it cannot use the session.
    pub fn short_id(&self) -> String {
        short_id(self.id)
    }

    /// The session's owner.
    pub fn owner(&self) -> &Owner {
        &self.owner
    }

    /// How the session was opened.
    pub fn opening(&self) -> &Opening {
        &self.opening
    }

    /// The session's name in the store.
    pub fn name(&self) -> SessionName {
        SessionName {
            id: self.id,
            incarnation: self.opening.incarnation,
        }
    }

    /// Width and height of the session's frames as uploaded.
    pub fn source_size(&self) -> (u32, u32) {
        self.source_size
    }

    /// How many targets it has.
    pub fn target_count(&self) -> usize {
        self.target_count
    }

    /// The trackers' parameters, with the seed of the first one.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// The last answer.
    pub fn latest(&self) -> Estimates {
        self.latest.borrow().clone()
    }

    /// The number of the last frame that was answered.
    pub fn latest_frame(&self) -> u64 {
        self.latest.borrow().first().frame
    }

    /// Which version of the record in the store the state goes on from; none where there is no record.
    pub fn version(&self) -> Option<Version> {
        *lock(&self.version)
    }

    /// Notes which version of the record in the store the state goes on from.
    pub(super) fn set_version(&self, version: Option<Version>) {
        *lock(&self.version) = version;
    }

    /// The last frame whose state is in the store, where there is one.
    pub fn checkpoint(&self) -> Option<u64> {
        self.version().map(|version| version.checkpoint)
    }

    /// When the session expires unless a frame comes, by its clock.
    pub fn expires(&self) -> Duration {
        Duration::from_millis(self.expires_ms.load(Ordering::Relaxed))
    }

    /// How long the session lives without a frame.
    pub fn ttl(&self) -> Duration {
        self.expires().saturating_sub(self.clock.now())
    }

    /// The session expires after this time without a frame.
    pub fn set_ttl(&self, ttl: Duration) {
        let expires = milliseconds(self.clock.now() + ttl);
        self.expires_ms.store(expires, Ordering::Relaxed);
    }

    /// Lets the session live at least its idle time from now. For a frame that was taken, or that was refused for want
    /// of room or time.
    pub fn renew(&self) {
        let expires = milliseconds(self.clock.now() + self.idle);
        self.expires_ms.fetch_max(expires, Ordering::Relaxed);
    }

    /// Whether a request has a permit of the session.
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
