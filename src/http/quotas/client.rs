//! Who a request comes from, as far as quotas and turns go.

use axum::http::request::Parts;
use bagtrack_net::{customer_address, wider_networks};
use ipnet::Ipv6Net;
use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;
use uuid::Uuid;

/// The address at the other end of the connection.
#[derive(Debug, Clone, Copy)]
pub struct Peer(pub SocketAddr);

/// A client: who shares quotas and turns. Whoever authenticates a request puts [`Client::Key`] or [`Client::Page`]
/// into its extensions before its handler runs; else it is the address.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Client {
    /// The name of an API key.
    Key(Arc<str>),
    /// A page with a token of this key for this session: a part of the client with the key.
    Page(Arc<str>, Uuid),
    /// An IPv4 address, or the first address of an IPv6 network of 64 bits.
    Address(IpAddr),
}

impl Client {
    /// The client at this address.
    pub fn at(address: IpAddr) -> Self {
        Self::Address(customer_address(address))
    }

    /// The networks that the client is in, which its provider may have given to one customer too.
    pub fn networks(&self) -> impl Iterator<Item = Ipv6Net> {
        let address = match self {
            Self::Address(address) => Some(*address),
            Self::Key(_) | Self::Page(..) => None,
        };
        address.into_iter().flat_map(wider_networks)
    }

    /// The key, where one or a token of it came with the request.
    pub fn key(&self) -> Option<&Arc<str>> {
        match self {
            Self::Key(name) | Self::Page(name, _) => Some(name),
            Self::Address(_) => None,
        }
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
            Self::Key(name) | Self::Page(name, _) => write!(formatter, "key {name}"),
            Self::Address(address) => write!(formatter, "address {address}"),
        }
    }
}
