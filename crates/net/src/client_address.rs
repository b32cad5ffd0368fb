//! The address of a request's client, behind trusted proxies; and the addresses that belong to one customer of a
//! provider.
//!
//! Proxies tell the client's address in `Forwarded` (RFC 7239) or `X-Forwarded-For`. Each proxy adds the address that
//! called it at the end of the list. So the list is read from its end: the first address that is no trusted proxy's is
//! the client's. The client may have written all that is before it.
//!
//! A proxy that adds to one of the two headers passes the other one on as the client wrote it. So if both are there and
//! disagree, neither is believed, and the client is the proxy.
//!
//! A provider gives a customer a whole network of IPv6.

use axum::http::HeaderMap;
use axum::http::header::FORWARDED;
use ipnet::{IpNet, Ipv6Net};
use std::net::{IpAddr, SocketAddr};

const X_FORWARDED_FOR: &str = "x-forwarded-for";

/// The address of the client of a request that came from `peer`.
pub fn client_address(peer: IpAddr, headers: &HeaderMap, trusted: &[IpNet]) -> IpAddr {
    let peer = peer.to_canonical();
    if !is_trusted(peer, trusted) {
        return peer;
    }
    let forwarded = list(headers, FORWARDED.as_str());
    let forwarded =
        forwarded.map(|hops| walk(peer, hops.iter().map(|hop| of_forwarded(hop)), trusted));
    let x_forwarded = list(headers, X_FORWARDED_FOR);
    let x_forwarded =
        x_forwarded.map(|hops| walk(peer, hops.iter().map(|hop| parse(hop)), trusted));
    match (forwarded, x_forwarded) {
        (Some(one), Some(other)) if one != other => peer,
        (one, other) => one.or(other).unwrap_or(peer),
    }
}

/// Whether a request has `Forwarded` or `X-Forwarded-For`.
pub fn is_forwarded(headers: &HeaderMap) -> bool {
    headers.contains_key(FORWARDED) || headers.contains_key(X_FORWARDED_FOR)
}

/// Whether the address is a trusted proxy's.
pub fn is_trusted(address: IpAddr, trusted: &[IpNet]) -> bool {
    trusted.iter().any(|network| network.contains(&address))
}

/// The elements of a header that is a list, from all its lines; `None` without the header.
fn list<'a>(headers: &'a HeaderMap, name: &str) -> Option<Vec<&'a str>> {
    let lines = headers.get_all(name).iter();
    // A line that is not text is one hop without a readable address.
    let hops = lines.flat_map(|line| line.to_str().unwrap_or("").split(','));
    let hops: Vec<&str> = hops.map(str::trim).collect();
    (!hops.is_empty()).then_some(hops)
}

/// The first address from the end that is no trusted proxy's, or the last one that can be read.
fn walk(
    peer: IpAddr,
    hops: impl DoubleEndedIterator<Item = Option<IpAddr>>,
    trusted: &[IpNet],
) -> IpAddr {
    let mut last = peer;
    for hop in hops.rev() {
        let Some(hop) = hop else { break };
        last = hop;
        if !is_trusted(hop, trusted) {
            break;
        }
    }
    last
}

/// The address in `for=…` of one element.
fn of_forwarded(element: &str) -> Option<IpAddr> {
    let mut pairs = element.split(';').filter_map(|pair| pair.split_once('='));
    let (_, value) = pairs.find(|(name, _)| name.trim().eq_ignore_ascii_case("for"))?;
    parse(value.trim().trim_matches('"'))
}

/// An address with or without a port, an IPv6 one with or without brackets.
fn parse(text: &str) -> Option<IpAddr> {
    let bracketed = || text.strip_prefix('[')?.strip_suffix(']')?.parse().ok();
    let with_port = || text.parse().ok().map(|address: SocketAddr| address.ip());
    let address: Option<IpAddr> = text.parse().ok().or_else(bracketed).or_else(with_port);
    address.map(|address| address.to_canonical())
}

/// The address at the other end of a connection.
#[derive(Debug, Clone, Copy)]
pub struct Peer(pub SocketAddr);

/// Prefix length, in bits, of the smallest IPv6 network that a provider gives to one customer (RFC 6177).
const IPV6_PREFIX: u8 = 64;
/// Prefix lengths of the wider networks that some customers get.
const WIDER_PREFIXES: [u8; 2] = [48, 56];

/// The address that stands for all addresses of one customer: an IPv4 address itself, or the first address of its IPv6
/// network of 64 bits.
pub fn customer_address(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(address) => {
            let network = Ipv6Net::new(address, IPV6_PREFIX);
            network.map_or(address, |network| network.network()).into()
        }
        address => address,
    }
}

/// The wider IPv6 networks that the address is in: a provider may have given one of them to a single customer.
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

    const F: &str = "forwarded";
    const X: &str = "x-forwarded-for";

    fn client(peer: &str, headers: &[(&'static str, &str)]) -> String {
        let trusted = ["10.0.0.0/8".parse().unwrap(), "fd00::/8".parse().unwrap()];
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            map.append(*name, value.parse().unwrap());
        }
        client_address(peer.parse().unwrap(), &map, &trusted).to_string()
    }

    proptest::proptest! {
        #[test]
        fn nothing_that_a_client_writes_before_what_the_proxy_adds_changes_whose_request_it_is(
            before in "[ -~]{0,60}", lines in 0..3_usize
        ) {
            let mut headers = vec![(X, before.as_str()); lines];
            let added = format!("{before}, 198.51.100.9");
            headers.push((X, &added));
            proptest::prop_assert_eq!(client("10.0.0.1", &headers), "198.51.100.9");
            proptest::prop_assert_eq!(client("192.0.2.1", &headers), "192.0.2.1");
        }
    }

    #[test]
    fn only_trusted_proxies_are_believed_and_only_what_they_added() {
        for (peer, headers, expected) in [
            ("192.0.2.1", &[(X, "198.51.100.9")][..], "192.0.2.1"),
            ("10.0.0.1", &[], "10.0.0.1"),
            ("10.0.0.1", &[(X, "198.51.100.9")], "198.51.100.9"),
            (
                "10.0.0.1",
                &[(X, "1.1.1.1, 198.51.100.9, 10.0.0.2")],
                "198.51.100.9",
            ),
            (
                "10.0.0.1",
                &[(X, "1.1.1.1"), (X, "198.51.100.9")],
                "198.51.100.9",
            ),
            (
                "10.0.0.1",
                &[(X, "1.1.1.1, nonsense, 10.0.0.2")],
                "10.0.0.2",
            ),
            (
                "::ffff:10.0.0.1",
                &[(X, "[2001:db8::1]:4711")],
                "2001:db8::1",
            ),
            (
                "fd00::1",
                &[(F, "for=1.1.1.1, for=\"[2001:db8::1]:80\";proto=https")],
                "2001:db8::1",
            ),
            (
                "10.0.0.1",
                &[(F, "proto=https;For=198.51.100.9:80")],
                "198.51.100.9",
            ),
            ("10.0.0.1", &[(F, "for=_hidden")], "10.0.0.1"),
            (
                "10.0.0.1",
                &[(F, "for=1.1.1.1"), (X, "198.51.100.9")],
                "10.0.0.1",
            ),
            ("10.0.0.1", &[(F, "for=1.1.1.1"), (X, "1.1.1.1")], "1.1.1.1"),
        ] {
            assert_eq!(client(peer, headers), expected, "{peer} {headers:?}");
        }
    }

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
