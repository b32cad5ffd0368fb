//! A client's account: its quotas, and what it uses of them.
//!
//! Quotas are shares of what the service has: sessions and their bytes, requests in flight, streams, bytes of uploads,
//! and frames and requests a second.

use super::clients::{Client, Holdings, Network};
use super::rates::{self, FrameRate, Rate, RateExceeded};
use super::video_places::VideoPlaces;
use bagtrack_net::MessageRate;
use bagtrack_sessions::clock::{self, Instant, sleep, sleep_until, timeout_at};
use bagtrack_sessions::{Budget, BudgetFull, Charge, Flow, QuotaExhausted};
use governor::DefaultDirectRateLimiter;
use std::num::NonZeroU32;
use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// The quotas of one client: the most that it may have of each.
#[derive(Debug, Clone, Copy)]
pub struct Quotas {
    pub sessions: usize,
    pub session_bytes: usize,
    pub requests: usize,
    pub streams: usize,
    pub upload_bytes: usize,
    pub frames: Option<Rate>,
}

impl Quotas {
    /// The budgets of a client in these networks.
    fn holdings(&self, networks: &[Arc<Network>]) -> Holdings {
        let budget = |most, of: fn(&Holdings) -> &Budget| {
            Budget::of_client(
                most,
                networks
                    .iter()
                    .map(|network| of(&network.held).clone())
                    .collect(),
            )
        };
        Holdings {
            sessions: budget(self.sessions, |held| &held.sessions),
            session_bytes: budget(self.session_bytes, |held| &held.session_bytes),
            upload_bytes: budget(self.upload_bytes, |held| &held.upload_bytes),
            streams: budget(self.streams, |held| &held.streams),
        }
    }
}

/// What one client has in use.
#[derive(Debug)]
pub struct Account {
    pub(super) client: Client,
    /// For the account of a page, which has a token of an API key: the account of that key, which counts the frames.
    key: Option<Arc<Account>>,
    flow: Flow,
    pub(super) quotas: Quotas,
    pub(super) all: Holdings,
    pub(super) held: Holdings,
    /// Keeps the holdings of the client's networks as long as its account.
    _networks: Vec<Arc<Network>>,
    requests: Arc<Semaphore>,
    /// The places for decoding videos that a video of the client takes: its own, then those of its networks.
    videos: Vec<VideoPlaces>,
    messages: Arc<MessageRate>,
    asked: DefaultDirectRateLimiter,
    handshakes: DefaultDirectRateLimiter,
    /// Held while the next handshake waits for the rate, so that the others wait in order of arrival.
    next_handshake: tokio::sync::Mutex<()>,
    frames: Option<FrameRate>,
    /// Held while the next frame waits for the rate, so that the others wait in order of arrival.
    next_frame: tokio::sync::Mutex<()>,
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
        networks: Vec<Arc<Network>>,
    ) -> Self {
        let of_networks = networks.iter().map(|network| network.videos.clone());
        Self {
            client,
            key: None,
            flow,
            quotas,
            all,
            held: quotas.holdings(&networks),
            videos: [VideoPlaces::new(1)]
                .into_iter()
                .chain(of_networks)
                .collect(),
            _networks: networks,
            requests: places(quotas.requests),
            messages: Arc::new(rates::limiter(rates::MESSAGES)),
            asked: rates::limiter(rates::ASKED),
            handshakes: rates::limiter(rates::HANDSHAKES),
            next_handshake: tokio::sync::Mutex::default(),
            frames: quotas.frames.map(FrameRate::new),
            next_frame: tokio::sync::Mutex::default(),
        }
    }

    /// The account of a page with a token of this key, which is a part of the key's account. A page may send a body as
    /// slowly as it likes, and holds memory and a place for a request meanwhile. So it may use only a part of the key's
    /// memory and places; it shares all else with the key.
    pub(super) fn of_page(client: Client, key: Arc<Self>) -> Self {
        let requests = key.quotas.requests.div_ceil(2);
        let quotas = Quotas {
            requests,
            frames: None,
            ..key.quotas
        };
        let of_page = Self::new(client, key.flow, quotas, key.all.clone(), Vec::new());
        Self {
            held: Holdings {
                upload_bytes: key.held.upload_bytes.part(),
                ..key.held.clone()
            },
            videos: key.videos.clone(),
            messages: key.messages.clone(),
            key: Some(key),
            ..of_page
        }
    }

    /// Whether the account may be forgotten: nothing is held and, for a key, its whole burst of frames is available
    /// again. For addresses the frames are not waited for, since there may be very many addresses.
    pub(super) fn is_idle(&self) -> bool {
        if self.key.is_some() {
            return self.held.upload_bytes.held() == 0;
        }
        let owes = |((_, burst), left): (Rate, u32)| left < burst.get();
        let owes = matches!(self.client, Client::Key(_)) && self.frames().is_some_and(owes);
        self.held.is_empty() && !owes
    }

    fn counting_frames(&self) -> &Self {
        self.key.as_deref().unwrap_or(self)
    }

    /// The flow in whose turns the client's work is done.
    pub fn flow(&self) -> Flow {
        self.flow
    }

    /// How many sessions, counted by their targets, the client may have, and how many of them are left.
    pub fn sessions(&self) -> (usize, usize) {
        (self.quotas.sessions, self.held.sessions.left())
    }

    /// How many requests in flight the client may have, and how many of them are left. A page takes no more of its
    /// key's places than it leaves free.
    pub fn requests(&self) -> (usize, usize) {
        let most = self.quotas.requests;
        let left = self.requests.available_permits();
        let Some(key) = &self.key else {
            return (most, left);
        };
        let of_key = key.requests.available_permits();
        (
            most,
            left.min(of_key.saturating_sub(most.saturating_sub(left))),
        )
    }

    /// The client's frame rate with its burst, and how many frames it may send now; `None` where frames are not
    /// counted.
    pub fn frames(&self) -> Option<(Rate, u32)> {
        let counting = self.counting_frames();
        Some((counting.quotas.frames?, counting.frames.as_ref()?.left()))
    }

    /// Takes a place for a request in flight.
    ///
    /// # Errors
    /// The client has as many as it may.
    pub fn request(self: &Arc<Self>) -> Result<RequestPermit, QuotaExhausted> {
        let (limit, left) = self.requests();
        let refused = QuotaExhausted {
            what: "requests in flight",
            limit,
        };
        if left == 0 {
            return Err(refused);
        }
        let take = |places: &Arc<Semaphore>| places.clone().try_acquire_owned();
        let of_key = self.key.as_ref().map(|key| take(&key.requests));
        Ok(RequestPermit {
            account: self.clone(),
            _permit: take(&self.requests).map_err(|_| refused)?,
            _of_key: of_key.transpose().map_err(|_| refused)?,
        })
    }

    /// Takes a place for a request in flight, and waits for it in order of arrival.
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
        let count = || rates::count_one(&self.handshakes, "handshakes a second", rates::HANDSHAKES);
        while let Err(exceeded) = count() {
            sleep(exceeded.wait).await;
        }
    }

    /// Counts a request that takes no turn at the workers.
    ///
    /// # Errors
    /// The client has sent too many such requests lately.
    pub fn count_asked(&self) -> Result<(), RateExceeded> {
        let what = "requests a second for pages and states";
        rates::count_one(&self.asked, what, rates::ASKED)
    }

    /// Takes a place for a stream.
    ///
    /// # Errors
    /// The client has as many streams as it may, or as many as are free.
    pub fn stream(&self) -> Result<Charge, QuotaExhausted> {
        let mut place = Charge::new(&self.all.streams, &self.held.streams);
        let taken = place.grow(1);
        taken.map_err(|full| QuotaExhausted {
            what: "streams",
            limit: match full {
                BudgetFull::Client => self.quotas.streams,
                BudgetFull::All => self.held.streams.held(),
            },
        })?;
        Ok(place)
    }

    /// Waits until `deadline` for the places that a video of the client takes while it is decoded, one of each of
    /// [`Self::videos`].
    ///
    /// # Errors
    /// The client's other video, or those of its network, take longer.
    pub async fn video_until(
        &self,
        deadline: Instant,
    ) -> Result<Vec<OwnedSemaphorePermit>, QuotaExhausted> {
        let mut taken = Vec::new();
        for places in &self.videos {
            let place = places.take_until(deadline).await;
            taken.push(place.ok_or(QuotaExhausted {
                what: "videos at a time",
                limit: places.all(),
            })?);
        }
        Ok(taken)
    }

    /// The places for decoding videos: the client's own, then those of its networks.
    pub fn videos(&self) -> &[VideoPlaces] {
        &self.videos
    }

    /// The rate at which the client may send frames of WebSockets, for all of its connections.
    pub fn messages(&self) -> Arc<MessageRate> {
        self.messages.clone()
    }

    /// The budget of bytes of the client's uploads and answers.
    pub fn bytes(&self) -> &Budget {
        &self.held.upload_bytes
    }

    /// Counts one frame, once the rate allows it; callers wait in order of arrival.
    ///
    /// # Errors
    /// The rate allows no further frame until `deadline`.
    pub async fn count_frame_in_order(&self, deadline: Instant) -> Result<(), RateExceeded> {
        let turn = timeout_at(deadline, self.counting_frames().next_frame.lock()).await;
        loop {
            let Err(exceeded) = self.count_frames(1) else {
                return Ok(());
            };
            let again = clock::now() + exceeded.wait;
            if turn.is_err() || again > deadline {
                return Err(exceeded);
            }
            sleep_until(again).await;
        }
    }

    /// Counts frames against the client's frame rate.
    ///
    /// # Errors
    /// The client has sent too many frames lately.
    pub fn count_frames(&self, frames: usize) -> Result<(), RateExceeded> {
        let frames = u32::try_from(frames).ok().and_then(NonZeroU32::new);
        match (&self.counting_frames().frames, frames) {
            (Some(rate), Some(frames)) => rate.count(frames),
            _ => Ok(()),
        }
    }
}

impl RequestPermit {
    /// The flow in whose turns the request's work is done.
    pub fn flow(&self) -> Flow {
        self.account.flow
    }

    /// The budget of bytes of the client's uploads and answers.
    pub fn bytes(&self) -> &Budget {
        self.account.bytes()
    }

    /// Counts the frames of the request.
    ///
    /// # Errors
    /// The client has sent too many frames lately.
    pub fn count_frames(&self, frames: usize) -> Result<(), RateExceeded> {
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
