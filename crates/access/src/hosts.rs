//! Which hosts requests may name.
//!
//! A malicious page can make its own host name resolve to this machine (DNS rebinding). The browser then treats the
//! service as the page's own origin, and lets the page call it. But such requests still name the page's host.

use bagtrack_config::Config;
use std::net::IpAddr;

/// The hosts that requests may name.
#[derive(Debug, Clone, Copy)]
pub enum AllowedHosts<'a> {
    /// Any host.
    All,
    /// The names and addresses of this machine.
    Loopback,
    /// These hosts; one that is listed without a port may be named with any.
    Listed(&'a [String]),
}

impl<'a> AllowedHosts<'a> {
    /// The hosts that the settings allow. Where they list none, only names of this machine are allowed if the service
    /// listens on loopback, needs no key, and has no trusted proxies.
    pub fn of(config: &'a Config, needs_key: bool) -> Self {
        let hosts = &config.access.allowed_hosts;
        let is_local = config.listen.ip().is_loopback() && config.limits.trusted_proxies.is_empty();
        match (hosts.is_empty(), is_local && !needs_key) {
            (false, _) => Self::Listed(hosts),
            (true, true) => Self::Loopback,
            (true, false) => Self::All,
        }
    }

    /// Whether requests may name `host`. It is empty for a request of HTTP/1.0 without a host, which no browser sends.
    pub fn have(&self, host: &str) -> bool {
        match self {
            Self::All => true,
            Self::Loopback => host.is_empty() || is_loopback(without_port(host)),
            Self::Listed(hosts) => hosts.iter().any(|allowed| is_host(allowed, host)),
        }
    }
}

fn is_loopback(host: &str) -> bool {
    let name = host.to_ascii_lowercase();
    let address = name.trim_start_matches('[').trim_end_matches(']');
    let address = address.parse::<IpAddr>();
    // Names below `localhost` are this machine's, too (RFC 6761, section 6.3).
    name == "localhost"
        || name.ends_with(".localhost")
        || address.is_ok_and(|address| address.to_canonical().is_loopback())
}

/// Whether `host` is the allowed one. If that has no port, any port fits.
fn is_host(allowed: &str, host: &str) -> bool {
    allowed.eq_ignore_ascii_case(host) || allowed.eq_ignore_ascii_case(without_port(host))
}

fn without_port(host: &str) -> &str {
    match host.rsplit_once(':') {
        // The colons of an IPv6 address are in brackets.
        Some((name, port)) if !port.contains(']') => name,
        _ => host,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hosts_are_compared_with_or_without_their_port() {
        for (allowed, host, expected) in [
            ("example.org", "example.org", true),
            ("example.org", "EXAMPLE.org:8080", true),
            ("example.org:8080", "example.org:8080", true),
            ("example.org:8080", "example.org", false),
            ("example.org", "example.org.evil.net", false),
            ("[::1]", "[::1]:8080", true),
            ("[::1]", "[::1]", true),
            ("example.org", "", false),
        ] {
            let allowed = [allowed.to_owned()];
            assert_eq!(
                AllowedHosts::Listed(&allowed).have(host),
                expected,
                "{host}"
            );
        }
    }

    #[test]
    fn the_hosts_of_this_machine_are_its_names_and_loopback_addresses() {
        for host in [
            "localhost",
            "LOCALHOST:8080",
            "page.localhost:1",
            "127.0.0.1:80",
            "127.9.9.9",
            "[::1]:8080",
            "[::1]",
            "",
        ] {
            assert!(AllowedHosts::Loopback.have(host), "{host}");
        }
        for host in [
            "localhost.example.org",
            "example.org:8080",
            "0.0.0.0",
            "192.0.2.1",
            "127.0.0.1.example.org",
            "[::2]",
        ] {
            assert!(!AllowedHosts::Loopback.have(host), "{host}");
        }
    }
}
