//! Who a request comes from, as far as quotas and turns go.

use bagtrack_net::{customer_address, wider_networks};
use ipnet::Ipv6Net;
use std::fmt;
use std::net::IpAddr;
use std::sync::Arc;
use uuid::Uuid;

/// A client: who shares quotas and turns.
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
}

impl fmt::Display for Client {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Key(name) | Self::Page(name, _) => write!(formatter, "key {name}"),
            Self::Address(address) => write!(formatter, "address {address}"),
        }
    }
}
