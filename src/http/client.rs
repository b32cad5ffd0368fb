//! Who a request comes from, as far as quotas and turns go.

use super::forwarded::address;
use super::problems::kind::Kind;
use super::problems::problem::Problem;
use super::state::AppState;
use axum::extract::{Request, State};
use axum::http::request::Parts;
use axum::middleware::Next;
use axum::response::Response;
use ipnet::Ipv6Net;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

/// Bits of an IPv6 address that a provider gives to one customer (RFC 6177).
const IPV6_PREFIX: u8 = 64;

/// How long an answer that refuses a client for its quota is held back.
const REFUSAL_DELAY: Duration = Duration::from_millis(250);

/// The address at the other end of the connection.
#[derive(Debug, Clone, Copy)]
pub struct Peer(pub SocketAddr);

/// A client: who shares quotas and turns. Whoever authenticates a request puts [`Client::Key`] into its extensions
/// before its handler runs; else it is the address.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Client {
    /// The name of an API key.
    Key(Arc<str>),
    /// An IPv4 address, or the first address of an IPv6 network of 64 bits.
    Address(IpAddr),
}

impl Client {
    /// The client at this address.
    pub fn at(address: IpAddr) -> Self {
        let address = match address.to_canonical() {
            IpAddr::V6(address) => {
                let network = Ipv6Net::new(address, IPV6_PREFIX);
                network.map_or(address, |network| network.network()).into()
            }
            address => address,
        };
        Self::Address(address)
    }

    /// The client of a request that has passed [`identify`].
    pub fn of(parts: &Parts) -> Self {
        let client = parts.extensions.get::<Self>().cloned();
        client.unwrap_or_else(|| Self::at(Ipv4Addr::UNSPECIFIED.into()))
    }
}

/// Middleware: notes the client of a request that has none yet, and tells the client what is left of its quotas.
pub async fn identify(State(state): State<AppState>, mut request: Request, next: Next) -> Response {
    if request.extensions().get::<Client>().is_none() {
        let peer = request.extensions().get::<Peer>();
        let peer = peer.map_or(Ipv4Addr::UNSPECIFIED.into(), |Peer(peer)| peer.ip());
        let trusted = &state.config.limits.trusted_proxies;
        let client = Client::at(address(peer, request.headers(), trusted));
        request.extensions_mut().insert(client);
    }
    let has_quotas = request.uri().path().starts_with("/sessions");
    let client = request.extensions().get::<Client>().cloned();
    let mut response = next.run(request).await;
    let problem = response.extensions().get::<Problem>();
    if problem.is_some_and(|problem| problem.kind() == Kind::QuotaExceeded) {
        // Whoever does not wait before it asks again costs the network threads time.
        tokio::time::sleep(REFUSAL_DELAY).await;
    }
    if let (true, Some(client)) = (has_quotas, client) {
        state.clients.write_headers(&client, response.headers_mut());
    }
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ipv6_network_is_one_client_and_a_mapped_address_is_its_ipv4() {
        let at = |text: &str| Client::at(text.parse().unwrap());
        assert_eq!(at("2001:db8:1:2:3::4"), at("2001:db8:1:2::"));
        assert_ne!(at("2001:db8:1:2::"), at("2001:db8:1:3::"));
        assert_eq!(at("::ffff:192.0.2.7"), at("192.0.2.7"));
        assert_ne!(at("192.0.2.7"), at("192.0.2.8"));
    }
}
