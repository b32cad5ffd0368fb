//! Notes which client a request is from, and tells the client what is left of its quotas.

use crate::http::problems::problem::Problem;
use crate::http::respond::rate_limit::write_headers;
use crate::http::state::AppState;
use axum::extract::Request;
use axum::response::Response;
use bagtrack_api::ProblemKind as Kind;
use bagtrack_net::Peer;
use bagtrack_net::{client_address, is_forwarded, is_trusted};
use bagtrack_quotas::Client;
use bagtrack_sessions::clock::sleep;
use std::net::{IpAddr, Ipv4Addr};
use std::time::Duration;
use tracing::Span;

/// How long an answer that refuses a client for its quota is held back.
pub(super) const REFUSAL_DELAY: Duration = Duration::from_millis(250);

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
pub(super) fn client_at(request: &Request) -> Option<Client> {
    let noted = request.extensions().get::<ClientAddress>();
    let noted = noted.filter(|noted| !noted.is_proxy)?;
    Some(Client::at(noted.address))
}

/// The middleware. A request that has its client already keeps it.
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
