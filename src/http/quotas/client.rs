//! Who a request comes from, as far as quotas and turns go.

use axum::http::request::Parts;
use ipnet::Ipv6Net;
use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;

/// Bits of an IPv6 address that a provider gives to one customer at least (RFC 6177).
const IPV6_PREFIX: u8 = 64;
/// Those that some customers get.
const WIDER_PREFIXES: [u8; 2] = [48, 56];

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

    /// The networks that the client is in, which its provider may have given to one customer too.
    pub fn networks(&self) -> impl Iterator<Item = Ipv6Net> {
        let address = match self {
            Self::Address(IpAddr::V6(address)) => Some(*address),
            Self::Key(_) | Self::Address(IpAddr::V4(_)) => None,
        };
        let networks = WIDER_PREFIXES.map(|bits| Some(Ipv6Net::new(address?, bits).ok()?.trunc()));
        networks.into_iter().flatten()
    }

    /// The client of a request that has passed the layer that notes it.
    pub fn of(parts: &Parts) -> Self {
        let client = parts.extensions.get::<Self>().cloned();
        client.unwrap_or_else(|| Self::at(Ipv4Addr::UNSPECIFIED.into()))
    }
}

impl fmt::Display for Client {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Key(name) => write!(formatter, "key {name}"),
            Self::Address(address) => write!(formatter, "address {address}"),
        }
    }
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
        let networks = |text: &str| at(text).networks().collect::<Vec<_>>();
        assert_eq!(networks("2001:db8:1:2::9"), networks("2001:db8:1:77::"));
        assert_ne!(networks("2001:db8:1:2::9"), networks("2001:db8:1:102::"));
        assert!(networks("192.0.2.7").is_empty());
    }
}
