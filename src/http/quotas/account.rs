//! What one client has in use, against its quotas.
//!
//! Quotas are shares of what the service has: sessions and their bytes, requests in flight, bytes of uploads, and frames
//! and requests a second.

use super::client::Client;
use super::holdings::Holdings;
use crate::http::problems::problem::Problem;
use bagtrack_net::MessageRate;
use bagtrack_sessions::clock::{self, Instant, sleep, sleep_until, timeout_at};
use bagtrack_sessions::{
    Budget, BudgetFull, Charge, Flow, OpenError, QuotaExhausted, Reservation, SessionQuota,
    StoreShare, TooManySessions,
};
use governor::clock::{Clock, DefaultClock};
use governor::middleware::StateInformationMiddleware;
use governor::state::{InMemoryState, NotKeyed};
use governor::{DefaultDirectRateLimiter, Quota, RateLimiter};
use std::num::NonZeroU32;
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

type FrameRate = RateLimiter<NotKeyed, InMemoryState, DefaultClock, StateInformationMiddleware>;

/// Frames of WebSockets a second, which carry messages: as many as some hundred cameras send, and so few that they take a
/// network thread little time, whatever is in them.
const MESSAGES: NonZeroU32 = NonZeroU32::new(10_000).expect("it is not 0");
/// And at once.
const MESSAGES_AT_ONCE: NonZeroU32 = NonZeroU32::new(2_000).expect("it is not 0");

/// Requests a second that take no turn at the workers: more than pages of some people and their programs ask for, and
/// so few that they take a network thread some percent of its time.
const ASKED: NonZeroU32 = NonZeroU32::new(500).expect("it is not 0");
/// And at once: the 70 files of the page, for a dozen people behind one address.
const ASKED_AT_ONCE: NonZeroU32 = NonZeroU32::new(1_000).expect("it is not 0");

/// TLS handshakes a second: the service signs in each, for which a network thread takes milliseconds with a large key of
/// RSA.
const HANDSHAKES: NonZeroU32 = NonZeroU32::new(25).expect("it is not 0");
/// And at once: the cameras and pages of some dozen people behind one address.
const HANDSHAKES_AT_ONCE: NonZeroU32 = NonZeroU32::new(64).expect("it is not 0");

/// What one client may have.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quotas {
    pub(super) sessions: usize,
    pub(super) session_bytes: usize,
    pub(super) requests: usize,
    pub(super) streams: usize,
    pub(super) upload_bytes: usize,
    /// Frames a second, and frames at once.
    pub(super) frames: Option<(NonZeroU32, NonZeroU32)>,
}

impl Quotas {
    /// What a client in these networks may hold.
    fn holdings(&self, networks: &[Arc<Holdings>]) -> Holdings {
        Holdings {
            sessions: of_client(self.sessions, networks, |held| &held.sessions),
            session_bytes: of_client(self.session_bytes, networks, |held| &held.session_bytes),
            upload_bytes: of_client(self.upload_bytes, networks, |held| &held.upload_bytes),
            streams: of_client(self.streams, networks, |held| &held.streams),
        }
    }
}

/// What one client has in use.
#[derive(Debug)]
pub struct Account {
    client: Client,
    /// That of the key, where this is a page's. It counts the frames.
    key: Option<Arc<Account>>,
    flow: Flow,
    pub(super) quotas: Quotas,
    all: Holdings,
    pub(super) held: Holdings,
    /// They are known as long as one of their clients is.
    _networks: Vec<Arc<Holdings>>,
    requests: Arc<Semaphore>,
    videos: Arc<Semaphore>,
    messages: Arc<MessageRate>,
    asked: DefaultDirectRateLimiter,
    handshakes: DefaultDirectRateLimiter,
    /// Whose handshake is next.
    next_handshake: tokio::sync::Mutex<()>,
    frames: Option<FrameRate>,
    /// Whose frame is counted next, where several wait for it.
    next_frame: tokio::sync::Mutex<()>,
    /// Frames that were left at some moment.
    frames_left: Mutex<(u32, Instant)>,
}

/// A request in flight.
#[derive(Debug)]
pub struct RequestPermit {
    account: Arc<Account>,
    _permit: OwnedSemaphorePermit,
    _of_key: Option<OwnedSemaphorePermit>,
}

impl Account {
    pub(super) fn new(
        client: Client,
        flow: Flow,
        quotas: Quotas,
        all: Holdings,
        networks: Vec<Arc<Holdings>>,
    ) -> Self {
        let held = quotas.holdings(&networks);
        let frames = quotas.frames.map(|(rate, burst)| {
            let quota = Quota::per_second(rate).allow_burst(burst);
            RateLimiter::direct(quota).with_middleware()
        });
        Self {
            client,
            key: None,
            flow,
            quotas,
            all,
            held,
            _networks: networks,
            requests: places(quotas.requests),
            videos: places(1),
            messages: Arc::new(rate(MESSAGES, MESSAGES_AT_ONCE)),
            asked: rate(ASKED, ASKED_AT_ONCE),
            handshakes: rate(HANDSHAKES, HANDSHAKES_AT_ONCE),
            next_handshake: tokio::sync::Mutex::default(),
            frames,
            next_frame: tokio::sync::Mutex::default(),
            frames_left: Mutex::new((
                quotas.frames.map_or(0, |(_, burst)| burst.get()),
                clock::now(),
            )),
        }
    }

    /// That of a page with a token of this key: a part of the key's. It cannot take from the key's other sessions what
    /// a body holds as slowly as it likes: memory, and places for requests. All else it shares with them.
    pub(super) fn of_page(client: Client, key: Arc<Self>) -> Self {
        let requests = key.quotas.requests.div_ceil(2);
        let held = Holdings {
            upload_bytes: key.held.upload_bytes.part(),
            ..key.held.clone()
        };
        Self {
            client,
            flow: key.flow,
            quotas: Quotas {
                requests,
                ..key.quotas
            },
            all: key.all.clone(),
            held,
            _networks: Vec::new(),
            requests: places(requests),
            videos: key.videos.clone(),
            messages: key.messages.clone(),
            asked: rate(ASKED, ASKED_AT_ONCE),
            handshakes: rate(HANDSHAKES, HANDSHAKES_AT_ONCE),
            next_handshake: tokio::sync::Mutex::default(),
            frames: None,
            next_frame: tokio::sync::Mutex::default(),
            frames_left: Mutex::new((0, clock::now())),
            key: Some(key),
        }
    }

    /// Whether it may be forgotten: nothing is held.
    pub(super) fn is_idle(&self) -> bool {
        match self.key {
            Some(_) => self.held.upload_bytes.held() == 0,
            None => self.held.is_empty(),
        }
    }

    /// Who counts frames.
    pub(super) fn counting_frames(&self) -> &Self {
        self.key.as_deref().unwrap_or(self)
    }

    /// In whose turn the client's work is done.
    pub fn flow(&self) -> Flow {
        self.flow
    }

    /// Places for requests in flight that are left. A page takes no more than it leaves of its key's.
    pub(super) fn requests_left(&self) -> usize {
        let left = self.requests.available_permits();
        let Some(key) = &self.key else { return left };
        let taken = self.quotas.requests.saturating_sub(left);
        let of_key = key.requests.available_permits();
        left.min(of_key.saturating_sub(taken))
    }

    /// Takes a place for a request in flight.
    ///
    /// # Errors
    /// The client has as many as it may.
    pub fn request(self: &Arc<Self>) -> Result<RequestPermit, Problem> {
        let refused = || Problem::quota_exceeded("requests in flight", self.quotas.requests);
        if self.requests_left() == 0 {
            return Err(refused());
        }
        let take = |places: &Arc<Semaphore>| places.clone().try_acquire_owned();
        let of_key = self.key.as_ref().map(|key| take(&key.requests));
        Ok(RequestPermit {
            account: self.clone(),
            _permit: take(&self.requests).map_err(|_| refused())?,
            _of_key: of_key.transpose().map_err(|_| refused())?,
        })
    }

    /// The same, but waits for a place, in order of arrival.
    pub async fn request_in_order(self: &Arc<Self>) -> RequestPermit {
        let permit = place_in_order(&self.requests).await;
        let of_key = match &self.key {
            Some(key) => Some(place_in_order(&key.requests).await),
            None => None,
        };
        RequestPermit {
            account: self.clone(),
            _permit: permit,
            _of_key: of_key,
        }
    }

    /// Waits until the client may make a TLS handshake, in order of arrival.
    pub async fn handshake_in_order(&self) {
        let _turn = self.next_handshake.lock().await;
        while let Err(not_yet) = self.handshakes.check() {
            sleep(not_yet.wait_time_from(DefaultClock::default().now())).await;
        }
    }

    /// Counts a request that takes no turn at the workers.
    ///
    /// # Errors
    /// The client has sent too many lately.
    pub fn count_asked(&self) -> Result<(), Problem> {
        let counted = self.asked.check();
        counted.map_err(|not_yet| {
            let wait = not_yet.wait_time_from(DefaultClock::default().now());
            let limit = usize::try_from(ASKED.get()).unwrap_or(usize::MAX);
            Problem::quota_exceeded("requests a second for pages and states", limit)
                .retry_after(wait)
        })
    }

    /// Takes a place for a stream.
    ///
    /// # Errors
    /// The client has as many as it may, or as are left to others.
    pub fn stream(&self) -> Result<Charge, Problem> {
        let mut place = Charge::new(&self.all.streams, &self.held.streams);
        let limit = |full| match full {
            BudgetFull::Client => self.quotas.streams,
            BudgetFull::All => self.held.streams.held(),
        };
        let taken = place.grow(1).map_err(limit);
        taken.map_err(|most| Problem::quota_exceeded("streams", most))?;
        Ok(place)
    }

    /// How many frames of WebSockets the client may send.
    pub fn messages(&self) -> Arc<MessageRate> {
        self.messages.clone()
    }

    /// The place for a video that is decoded.
    pub fn videos(&self) -> Arc<Semaphore> {
        self.videos.clone()
    }

    /// The bytes that the client may have inside.
    pub fn bytes(&self) -> &Budget {
        &self.held.upload_bytes
    }

    /// Why no session can be opened: the client has its maximum, or too little is left of what all may have.
    fn refusal(&self, full: BudgetFull, what: &'static str, limit: usize) -> OpenError {
        match full {
            BudgetFull::Client => QuotaExhausted { what, limit }.into(),
            BudgetFull::All => TooManySessions(self.all.sessions.held()).into(),
        }
    }

    fn note_frames_left(&self, left: u32) {
        // Nothing panics while it is held.
        let mut noted = self
            .frames_left
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        *noted = (left, clock::now());
    }

    /// Frames that are left now: those that were, and those that have come back since.
    pub(super) fn frames_left(&self, rate: NonZeroU32, burst: NonZeroU32) -> u32 {
        let noted = self
            .frames_left
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let (left, at) = *noted;
        let back = at.elapsed().as_secs_f64() * f64::from(rate.get());
        // The cast stops at the greatest value.
        left.saturating_add(back as u32).min(burst.get())
    }

    /// Waits until one frame more may be counted, in order of arrival.
    ///
    /// # Errors
    /// None may until `deadline`.
    pub async fn count_frame_in_order(&self, deadline: Instant) -> Result<(), Problem> {
        let counting = self.counting_frames();
        let turn = timeout_at(deadline, counting.next_frame.lock()).await;
        loop {
            let problem = match counting.count_frames(1) {
                Ok(()) => return Ok(()),
                Err(problem) => problem,
            };
            let wait = problem.wait().unwrap_or_default();
            let again = clock::now() + wait;
            if turn.is_err() || again > deadline {
                return Err(problem);
            }
            sleep_until(again).await;
        }
    }

    /// Counts frames of the client.
    ///
    /// # Errors
    /// It has sent too many lately.
    pub fn count_frames(&self, frames: usize) -> Result<(), Problem> {
        let counting = self.counting_frames();
        let frames = u32::try_from(frames).ok().and_then(NonZeroU32::new);
        let (Some(limiter), Some(frames)) = (&counting.frames, frames) else {
            return Ok(());
        };
        match limiter.check_n(frames) {
            Ok(Ok(state)) => {
                let left = state.remaining_burst_capacity();
                counting.note_frames_left(left);
                Ok(())
            }
            Ok(Err(not_yet)) => {
                let wait = not_yet.wait_time_from(DefaultClock::default().now());
                let rate = self.quotas.frames.map_or(0, |(rate, _)| rate.get());
                let rate = usize::try_from(rate).unwrap_or(usize::MAX);
                counting.note_frames_left(0);
                Err(Problem::quota_exceeded("frames a second", rate).retry_after(wait))
            }
            // A request has no more frames than fit at once.
            Err(_) => Ok(()),
        }
    }
}

/// The sessions of a client: as many places as sessions with one target would take.
#[derive(Debug)]
pub struct ClientSessions(pub Arc<Account>);

impl SessionQuota for ClientSessions {
    fn check(&self) -> Result<(), OpenError> {
        match self.0.held.sessions.left() {
            0 => Err(self
                .0
                .refusal(BudgetFull::Client, "sessions", self.0.quotas.sessions)),
            _ => Ok(()),
        }
    }

    fn store_share(&self) -> StoreShare {
        let Account { quotas, client, .. } = &*self.0;
        StoreShare {
            client: client.to_string(),
            max_places: quotas.sessions,
            max_bytes: quotas.session_bytes,
        }
    }

    fn reserve(&self, targets: usize, bytes: usize) -> Result<Reservation, OpenError> {
        let Account {
            all, held, quotas, ..
        } = &*self.0;
        let mut places = Charge::new(&all.sessions, &held.sessions);
        let full = places.grow(targets);
        full.map_err(|full| self.0.refusal(full, "sessions", quotas.sessions))?;
        let mut memory = Charge::new(&all.session_bytes, &held.session_bytes);
        let full = memory.grow(bytes);
        full.map_err(|full| {
            self.0
                .refusal(full, "bytes of sessions", quotas.session_bytes)
        })?;
        Ok(Box::new((self.0.clone(), places, memory)))
    }
}

impl RequestPermit {
    /// In whose turn the request's work is done.
    pub fn flow(&self) -> Flow {
        self.account.flow
    }

    /// The bytes that the client may have inside.
    pub fn bytes(&self) -> &Budget {
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

fn places(count: usize) -> Arc<Semaphore> {
    Arc::new(Semaphore::new(count.min(Semaphore::MAX_PERMITS)))
}

async fn place_in_order(places: &Arc<Semaphore>) -> OwnedSemaphorePermit {
    let place = places.clone().acquire_owned().await;
    place.expect("the places are never closed")
}

fn rate(a_second: NonZeroU32, at_once: NonZeroU32) -> DefaultDirectRateLimiter {
    RateLimiter::direct(Quota::per_second(a_second).allow_burst(at_once))
}

/// The budget of a client in these networks.
fn of_client(most: usize, networks: &[Arc<Holdings>], of: fn(&Holdings) -> &Budget) -> Budget {
    Budget::of_client(most, networks.iter().map(|held| of(held).clone()).collect())
}
