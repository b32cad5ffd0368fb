//! The addresses that people open in a browser.

use bagtrack::http::BasePath;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};

/// Where a running service is found.
#[derive(Debug, PartialEq, Eq)]
pub struct Addresses {
    /// The address on this machine.
    pub here: Option<String>,
    /// The address for other machines of the network.
    pub elsewhere: Option<String>,
}

impl Addresses {
    /// The addresses of a service that listens on `listen`, with this scheme and base path.
    pub fn of(scheme: &str, listen: SocketAddr, base_path: &BasePath) -> Self {
        let address = |ip: IpAddr| url(scheme, SocketAddr::new(ip, listen.port()), base_path);
        let ip = listen.ip();
        if !ip.is_unspecified() {
            let is_here = ip.is_loopback();
            return Self {
                here: is_here.then(|| address(ip)),
                elsewhere: (!is_here).then(|| address(ip)),
            };
        }
        Self {
            here: Some(address(loopback(ip))),
            elsewhere: network_address().map(address),
        }
    }
}

/// The address of a page of the service.
fn url(scheme: &str, address: SocketAddr, base_path: &BasePath) -> String {
    format!("{scheme}://{address}{base_path}")
}

/// The loopback address of the same version of IP.
pub fn loopback(ip: IpAddr) -> IpAddr {
    match ip {
        IpAddr::V4(_) => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(_) => Ipv6Addr::LOCALHOST.into(),
    }
}

/// The address of this machine in its network: the one that it would send from. Nothing is sent.
fn network_address() -> Option<IpAddr> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).ok()?;
    // An address for documentation (RFC 5737), which is beyond the network's router.
    socket.connect((Ipv4Addr::new(192, 0, 2, 1), 9)).ok()?;
    let ip = socket.local_addr().ok()?.ip();
    (!ip.is_loopback() && !ip.is_unspecified()).then_some(ip)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn addresses(scheme: &str, listen: &str, base_path: &str) -> Addresses {
        let base_path = base_path.parse().unwrap();
        Addresses::of(scheme, listen.parse().unwrap(), &base_path)
    }

    #[test]
    fn an_address_is_one_that_a_browser_can_open() {
        let found = addresses("http", "127.0.0.1:8080", "/");
        assert_eq!(found.here.as_deref(), Some("http://127.0.0.1:8080"));
        assert_eq!(found.elsewhere, None);
        let found = addresses("https", "192.0.2.7:8443", "/tracker");
        assert_eq!(found.here, None);
        assert_eq!(
            found.elsewhere.as_deref(),
            Some("https://192.0.2.7:8443/tracker")
        );
        let found = addresses("http", "0.0.0.0:80", "/");
        assert_eq!(found.here.as_deref(), Some("http://127.0.0.1:80"));
        assert!(found.elsewhere.is_none_or(|url| !url.contains("0.0.0.0")));
        let found = addresses("http", "[::]:80", "/");
        assert_eq!(found.here.as_deref(), Some("http://[::1]:80"));
    }
}
