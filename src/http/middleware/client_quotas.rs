//! Which client a request is from, how often the client may ask, and the headers that tell its quotas.
//!
//! Requests that take no turn at the workers have a rate: pages, states of sessions, refused requests. Network threads
//! do most of them, so a client that asks as fast as it can would take these threads from the others. All GET requests
//! count, though another thread renders the metrics, and workers make snapshots and pictures of the bag. The client is
//! known by its address, since pages and refusals need no key. A trusted proxy's own requests do not count.
//!
//! The answer has the quotas in the headers `RateLimit-Policy` and `RateLimit`
//! (draft-ietf-httpapi-ratelimit-headers).

use crate::http::problems::problem::Problem;
use crate::http::respond::answer::REPLAYED;
use crate::http::state::AppState;
use axum::extract::{MatchedPath, Request};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method};
use axum::response::{IntoResponse, Response};
use bagtrack_api::ProblemKind as Kind;
use bagtrack_net::{Peer, client_address, is_forwarded, is_trusted};
use bagtrack_quotas::{Account, Client};
use bagtrack_sessions::clock::sleep;
use std::net::{IpAddr, Ipv4Addr};
use std::time::Duration;
use tracing::Span;

/// How long an answer that refuses a client for its quota is held back.
const REFUSAL_DELAY: Duration = Duration::from_millis(250);

/// The client's address, as far as proxies are trusted.
#[derive(Debug, Clone, Copy)]
struct ClientAddress {
    address: IpAddr,
    /// Whether the request is a trusted proxy's own, not one that it forwards.
    is_proxy: bool,
}

pub fn note_address(state: &AppState, request: &mut Request) -> IpAddr {
    let peer = request.extensions().get::<Peer>();
    let peer = peer.map_or(Ipv4Addr::UNSPECIFIED.into(), |Peer(peer)| peer.ip());
    let trusted = &state.config.limits.trusted_proxies;
    let address = client_address(peer, request.headers(), trusted);
    // The address alone does not tell: a client gets its proxy's where the proxy's headers contradict each other.
    let is_proxy = is_trusted(peer.to_canonical(), trusted) && !is_forwarded(request.headers());
    let noted = ClientAddress { address, is_proxy };
    request.extensions_mut().insert(noted);
    address
}

/// The client at the noted address; `None` for a trusted proxy's own request.
fn client_at(request: &Request) -> Option<Client> {
    let noted = request.extensions().get::<ClientAddress>();
    let noted = noted.filter(|noted| !noted.is_proxy)?;
    Some(Client::at(noted.address))
}

/// Notes the client of a request by its address, unless its key names one. Its answer gets the headers with the quotas.
pub async fn identify(
    state: &AppState,
    mut request: Request,
    next: impl AsyncFnOnce(Request) -> Response,
) -> Response {
    match request.extensions().get::<Client>() {
        Some(client) => {
            if let Some(name) = client.key() {
                Span::current().record("key", &**name);
            }
        }
        None => {
            let noted = request.extensions().get::<ClientAddress>().copied();
            let address = noted.map_or(Ipv4Addr::UNSPECIFIED.into(), |noted| noted.address);
            request.extensions_mut().insert(Client::at(address));
        }
    }
    let client = request.extensions().get::<Client>().cloned();
    let mut response = next(request).await;
    let problem = response.extensions().get::<Problem>();
    if problem.is_some_and(|problem| problem.kind() == Kind::QuotaExceeded) {
        // Slows down a client that asks again at once, since its requests cost the network threads time.
        sleep(REFUSAL_DELAY).await;
    }
    if let Some(client) = client {
        write_headers(&state.clients.account(&client), response.headers_mut());
    }
    response
}

/// When a request counts against the rate of its client.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Counts {
    /// Before it is answered; over the rate it is refused.
    Always,
    /// After it is answered; over the rate its answer is only delayed: a supervisor must not take the service for dead
    /// because another client at the same address asks too often.
    AsProbe,
    /// After it is answered, and only where it was refused or got a stored answer: otherwise it took its turn at the
    /// workers.
    WithoutWork,
}

impl Counts {
    fn of(request: &Request) -> Self {
        let route = request.extensions().get::<MatchedPath>();
        let route = route.map_or("", MatchedPath::as_str);
        let sends_frames = matches!(*request.method(), Method::POST | Method::PUT);
        if route.ends_with("/healthz") || route.ends_with("/readyz") {
            Self::AsProbe
        } else if sends_frames && !route.ends_with("/token") {
            Self::WithoutWork
        } else {
            Self::Always
        }
    }
}

/// Bounds how often a client sends requests that take no turn at the workers. Runs after routing and [`note_address`].
pub async fn bound_rate(
    state: &AppState,
    request: Request,
    next: impl AsyncFnOnce(Request) -> Response,
) -> Response {
    let Some(client) = client_at(&request) else {
        return next(request).await;
    };
    let count = || state.clients.account(&client).count_asked();
    let counts = Counts::of(&request);
    if counts == Counts::Always
        && let Err(exceeded) = count()
    {
        // A client that asks again at once is answered no faster than one that waits.
        sleep(REFUSAL_DELAY).await;
        return Problem::from(exceeded).into_response();
    }
    let response = next(request).await;
    let counts_now = match counts {
        Counts::Always => false,
        Counts::AsProbe => true,
        Counts::WithoutWork => {
            response.status().is_client_error() || response.headers().contains_key(REPLAYED)
        }
    };
    if counts_now && count().is_err() {
        sleep(REFUSAL_DELAY).await;
    }
    response
}

/// The header with what is left of a client's quotas.
pub const RATE_LIMIT: HeaderName = HeaderName::from_static("ratelimit");
/// The header with a client's quotas.
pub const RATE_LIMIT_POLICY: HeaderName = HeaderName::from_static("ratelimit-policy");

/// Tells a client its quotas and what is left of them.
fn write_headers(account: &Account, headers: &mut HeaderMap) {
    let (requests, requests_left) = account.requests();
    let (sessions, sessions_left) = account.sessions();
    let mut policy = format!(
        "\"requests\";q={requests};qu=\"concurrent-requests\", \"sessions\";q={sessions};qu=\"sessions\""
    );
    let mut left = format!("\"requests\";r={requests_left}, \"sessions\";r={sessions_left}");
    if let Some(((rate, burst), frames_left)) = account.frames() {
        let window = burst.get().div_ceil(rate.get());
        policy += &format!(", \"frames\";q={burst};w={window};qu=\"frames\"");
        left += &format!(", \"frames\";r={frames_left};t={window}");
    }
    for (name, value) in [(RATE_LIMIT_POLICY, policy), (RATE_LIMIT, left)] {
        if let Ok(value) = HeaderValue::from_str(&value) {
            headers.insert(name, value);
        }
    }
}
