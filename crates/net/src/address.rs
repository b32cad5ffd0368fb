//! Which addresses are one customer's: a provider gives a customer a whole network of IPv6.

use ipnet::Ipv6Net;
use std::net::{IpAddr, SocketAddr};

/// The address at the other end of a connection.
#[derive(Debug, Clone, Copy)]
pub struct Peer(pub SocketAddr);

/// Bits of an IPv6 address that a provider gives to one customer at least (RFC 6177).
const IPV6_PREFIX: u8 = 64;
/// Those that some customers get.
const WIDER_PREFIXES: [u8; 2] = [48, 56];

/// What the addresses of one customer have in common: an IPv4 address, or the first address of an IPv6 network of 64
/// bits.
pub fn customer_address(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(address) => {
            let network = Ipv6Net::new(address, IPV6_PREFIX);
            network.map_or(address, |network| network.network()).into()
        }
        address => address,
    }
}

/// The networks of IPv6 that the address is in, which its provider may have given to one customer too.
pub fn wider_networks(address: IpAddr) -> impl Iterator<Item = Ipv6Net> {
    let address = match address {
        IpAddr::V6(address) => Some(address),
        IpAddr::V4(_) => None,
    };
    let networks = WIDER_PREFIXES.map(|bits| Some(Ipv6Net::new(address?, bits).ok()?.trunc()));
    networks.into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ipv6_network_is_one_customer_and_a_mapped_address_is_its_ipv4() {
        let at = |text: &str| customer_address(text.parse().unwrap());
        assert_eq!(at("2001:db8:1:2:3::4"), at("2001:db8:1:2::"));
        assert_ne!(at("2001:db8:1:2::"), at("2001:db8:1:3::"));
        assert_eq!(at("::ffff:192.0.2.7"), at("192.0.2.7"));
        assert_ne!(at("192.0.2.7"), at("192.0.2.8"));
        let networks = |text: &str| wider_networks(at(text)).collect::<Vec<_>>();
        assert_eq!(networks("2001:db8:1:2::9"), networks("2001:db8:1:77::"));
        assert_ne!(networks("2001:db8:1:2::9"), networks("2001:db8:1:102::"));
        assert!(networks("192.0.2.7").is_empty());
    }
}
