//! What each client has in use, against its quotas.
//!
//! Quotas are shares of what the service has: sessions, requests in flight, bytes of uploads, and frames a second. They
//! are told in the headers `RateLimit-Policy` and `RateLimit` (draft-ietf-httpapi-ratelimit-headers).

use super::client::Client;
use crate::http::config::service::Config;
use crate::http::problems::problem::Problem;
use axum::http::{HeaderMap, HeaderName, HeaderValue};
use bagtrack_sessions::{ByteBudget, Flow, QuotaExhausted, Reservation, SessionQuota};
use governor::clock::{Clock, DefaultClock};
use governor::middleware::StateInformationMiddleware;
use governor::state::{InMemoryState, NotKeyed};
use governor::{Quota, RateLimiter};
use std::collections::HashMap;
use std::num::NonZeroU32;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// The header with what is left of a client's quotas.
pub const RATE_LIMIT: HeaderName = HeaderName::from_static("ratelimit");
/// The header with a client's quotas.
pub const RATE_LIMIT_POLICY: HeaderName = HeaderName::from_static("ratelimit-policy");

/// Accounts above which those with nothing in use are forgotten.
const MAX_IDLE_ACCOUNTS: usize = 1024;

type FrameRate = RateLimiter<NotKeyed, InMemoryState, DefaultClock, StateInformationMiddleware>;

/// What one client may have.
#[derive(Debug, Clone, Copy)]
struct Quotas {
    sessions: usize,
    requests: usize,
    streams: usize,
    bytes: usize,
    /// Frames a second, and frames at once.
    frames: Option<(NonZeroU32, NonZeroU32)>,
}

/// The accounts of all clients.
#[derive(Debug)]
pub struct Clients {
    quotas: Quotas,
    accounts: Mutex<HashMap<Client, Arc<Account>>>,
    next_flow: AtomicU64,
}

/// What one client has in use.
#[derive(Debug)]
pub struct Account {
    flow: Flow,
    quotas: Quotas,
    sessions: Arc<Semaphore>,
    requests: Arc<Semaphore>,
    streams: Arc<Semaphore>,
    videos: Arc<Semaphore>,
    bytes: ByteBudget,
    frames: Option<FrameRate>,
    /// Frames that were left at some moment.
    frames_left: Mutex<(u32, Instant)>,
}

/// A request in flight.
#[derive(Debug)]
pub struct RequestPermit {
    account: Arc<Account>,
    _permit: OwnedSemaphorePermit,
}

impl Clients {
    /// No client yet, with the quotas of this configuration.
    pub fn new(config: &Config) -> Self {
        let limits = &config.limits;
        let quarter = |share: Option<usize>, whole: usize| share.unwrap_or(whole.div_ceil(4));
        let frames = NonZeroU32::new(limits.client_frame_rate).map(|rate| {
            // A request with as many frames as a request may have must fit.
            let burst = u32::try_from(config.max_frames).unwrap_or(u32::MAX);
            (rate, rate.max(NonZeroU32::new(burst).unwrap_or(rate)))
        });
        let bytes = quarter(limits.client_upload_bytes, config.max_upload_bytes);
        Self {
            quotas: Quotas {
                sessions: quarter(limits.client_sessions, config.max_sessions),
                requests: quarter(limits.client_requests, config.queue),
                streams: quarter(limits.client_connections, config.max_connections),
                bytes: bytes.max(config.max_body_bytes),
                frames,
            },
            accounts: Mutex::default(),
            next_flow: AtomicU64::new(0),
        }
    }

    /// The account of a client.
    pub fn account(&self, client: &Client) -> Arc<Account> {
        let mut accounts = self.lock();
        if let Some(account) = accounts.get(client) {
            return account.clone();
        }
        if accounts.len() >= MAX_IDLE_ACCOUNTS {
            accounts.retain(|_, account| Arc::strong_count(account) > 1);
        }
        let flow = Flow(self.next_flow.fetch_add(1, Ordering::Relaxed));
        let account = Arc::new(Account::new(flow, self.quotas));
        accounts.insert(client.clone(), account.clone());
        account
    }

    /// Tells a client its quotas and what is left of them.
    pub fn write_headers(&self, client: &Client, headers: &mut HeaderMap) {
        let account = self.account(client);
        let quotas = &self.quotas;
        let mut policy = format!(
            "\"requests\";q={};qu=\"concurrent-requests\", \"sessions\";q={};qu=\"sessions\"",
            quotas.requests, quotas.sessions
        );
        let mut left = format!(
            "\"requests\";r={}, \"sessions\";r={}",
            account.requests.available_permits(),
            account.sessions.available_permits()
        );
        if let Some((rate, burst)) = quotas.frames {
            let window = burst.get().div_ceil(rate.get());
            let frames_left = account.frames_left(rate, burst);
            policy += &format!(", \"frames\";q={burst};w={window};qu=\"frames\"");
            left += &format!(", \"frames\";r={frames_left};t={window}");
        }
        for (name, value) in [(RATE_LIMIT_POLICY, policy), (RATE_LIMIT, left)] {
            if let Ok(value) = HeaderValue::from_str(&value) {
                headers.insert(name, value);
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<Client, Arc<Account>>> {
        // Nothing panics while it is held.
        self.accounts.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Account {
    fn new(flow: Flow, quotas: Quotas) -> Self {
        let frames = quotas.frames.map(|(rate, burst)| {
            let quota = Quota::per_second(rate).allow_burst(burst);
            RateLimiter::direct(quota).with_middleware()
        });
        let permits = |count: usize| Arc::new(Semaphore::new(count.min(Semaphore::MAX_PERMITS)));
        Self {
            flow,
            quotas,
            sessions: permits(quotas.sessions),
            requests: permits(quotas.requests),
            streams: permits(quotas.streams),
            videos: permits(1),
            bytes: ByteBudget::new(quotas.bytes),
            frames,
            frames_left: Mutex::new((
                quotas.frames.map_or(0, |(_, burst)| burst.get()),
                Instant::now(),
            )),
        }
    }

    /// In whose turn the client's work is done.
    pub fn flow(&self) -> Flow {
        self.flow
    }

    /// Takes a place for a request in flight.
    ///
    /// # Errors
    /// The client has as many as it may.
    pub fn request(self: &Arc<Self>) -> Result<RequestPermit, Problem> {
        let permit = self.requests.clone().try_acquire_owned();
        let refused = |_| Problem::quota_exceeded("requests in flight", self.quotas.requests);
        Ok(RequestPermit {
            account: self.clone(),
            _permit: permit.map_err(refused)?,
        })
    }

    /// Takes a place for a stream.
    ///
    /// # Errors
    /// The client has as many as it may.
    pub fn stream(&self) -> Result<OwnedSemaphorePermit, Problem> {
        let permit = self.streams.clone().try_acquire_owned();
        permit.map_err(|_| Problem::quota_exceeded("streams", self.quotas.streams))
    }

    /// The place for a video that is decoded.
    pub fn videos(&self) -> Arc<Semaphore> {
        self.videos.clone()
    }

    /// The bytes that the client may have inside.
    pub fn bytes(&self) -> &ByteBudget {
        &self.bytes
    }
}

/// The sessions of a client: as many places as sessions with one target would take.
#[derive(Debug)]
pub struct ClientSessions(pub Arc<Account>);

impl SessionQuota for ClientSessions {
    fn check(&self) -> Result<(), QuotaExhausted> {
        match self.0.sessions.available_permits() {
            0 => Err(self.0.too_many_sessions()),
            _ => Ok(()),
        }
    }

    fn reserve(&self, targets: usize) -> Result<Reservation, QuotaExhausted> {
        let places = u32::try_from(targets).unwrap_or(u32::MAX);
        let permit = self.0.sessions.clone().try_acquire_many_owned(places);
        let permit = permit.map_err(|_| self.0.too_many_sessions())?;
        Ok(Box::new((self.0.clone(), permit)))
    }
}

impl RequestPermit {
    /// In whose turn the request's work is done.
    pub fn flow(&self) -> Flow {
        self.account.flow
    }

    /// The bytes that the client may have inside.
    pub fn bytes(&self) -> &ByteBudget {
        self.account.bytes()
    }

    /// Counts the frames of the request.
    ///
    /// # Errors
    /// The client has sent too many lately.
    pub fn count_frames(&self, frames: usize) -> Result<(), Problem> {
        self.account.count_frames(frames)
    }
}

impl Account {
    fn too_many_sessions(&self) -> QuotaExhausted {
        QuotaExhausted {
            limit: self.quotas.sessions,
        }
    }

    fn note_frames_left(&self, left: u32) {
        // Nothing panics while it is held.
        let mut noted = self
            .frames_left
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        *noted = (left, Instant::now());
    }

    /// Frames that are left now: those that were, and those that have come back since.
    fn frames_left(&self, rate: NonZeroU32, burst: NonZeroU32) -> u32 {
        let noted = self
            .frames_left
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let (left, at) = *noted;
        let back = at.elapsed().as_secs_f64() * f64::from(rate.get());
        // The cast stops at the greatest value.
        left.saturating_add(back as u32).min(burst.get())
    }

    /// Counts frames of the client.
    ///
    /// # Errors
    /// It has sent too many lately.
    pub fn count_frames(&self, frames: usize) -> Result<(), Problem> {
        let frames = u32::try_from(frames).ok().and_then(NonZeroU32::new);
        let (Some(limiter), Some(frames)) = (&self.frames, frames) else {
            return Ok(());
        };
        match limiter.check_n(frames) {
            Ok(Ok(state)) => {
                let left = state.remaining_burst_capacity();
                self.note_frames_left(left);
                Ok(())
            }
            Ok(Err(not_yet)) => {
                let wait = not_yet.wait_time_from(DefaultClock::default().now());
                let rate = self.quotas.frames.map_or(0, |(rate, _)| rate.get());
                let rate = usize::try_from(rate).unwrap_or(usize::MAX);
                self.note_frames_left(0);
                Err(Problem::quota_exceeded("frames a second", rate).retry_after(wait))
            }
            // A request has no more frames than fit at once.
            Err(_) => Ok(()),
        }
    }
}
