//! Which client a request is from, how often it may ask, and what it is told of its quotas.
//!
//! What takes no turn at the workers has a rate: pages, states, what is refused. Most of it is done on the network
//! threads, so a client that asks as fast as it can takes them from the others. The other requests by GET count with
//! it, though the metrics are rendered beside these threads, and a worker makes snapshots and pictures of the bag. The
//! client is known by its address, since pages and refusals need no key. A trusted proxy that asks for itself is not
//! counted.
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
    /// Whether a trusted proxy asks for itself.
    is_proxy: bool,
}

pub fn note_address(state: &AppState, request: &mut Request) -> IpAddr {
    let peer = request.extensions().get::<Peer>();
    let peer = peer.map_or(Ipv4Addr::UNSPECIFIED.into(), |Peer(peer)| peer.ip());
    let trusted = &state.config.limits.trusted_proxies;
    let address = client_address(peer, request.headers(), trusted);
    // Clients of a proxy whose headers contradict each other have its address, too.
    let is_proxy = is_trusted(peer.to_canonical(), trusted) && !is_forwarded(request.headers());
    let noted = ClientAddress { address, is_proxy };
    request.extensions_mut().insert(noted);
    address
}

/// The client at the noted address; none where a trusted proxy asks for itself.
fn client_at(request: &Request) -> Option<Client> {
    let noted = request.extensions().get::<ClientAddress>();
    let noted = noted.filter(|noted| !noted.is_proxy)?;
    Some(Client::at(noted.address))
}

/// Notes the client of a request, which keeps one that it has already.
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
        // Whoever does not wait before it asks again costs the network threads time.
        sleep(REFUSAL_DELAY).await;
    }
    if let Some(client) = client {
        write_headers(&state.clients.account(&client), response.headers_mut());
    }
    response
}

/// When a request counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Counts {
    /// Before it is answered, and it may be refused.
    Always,
    /// It is answered all the same, if late: whoever asks whether the service lives must not take it for dead, for the
    /// haste of another client at its address.
    AsProbe,
    /// Where it was refused, or answered as before: otherwise it took its turn at the workers.
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

/// Bounds how often a client asks for what takes no turn at the workers: pages, states, what is refused. It has to see
/// the matched route, and the address that was noted.
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
        // Whoever does not wait before it asks again is answered no faster.
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
