//! Which hosts requests may name.
//!
//! A page can make its own host name resolve to this machine. To the browser it is of the same origin then, and may
//! call whatever listens there. What it cannot do is name another host.

use bagtrack_config::Config;
use std::net::IpAddr;

/// The hosts that requests may name.
#[derive(Debug, Clone, Copy)]
pub enum AllowedHosts<'a> {
    /// Any.
    All,
    /// The names and addresses of this machine.
    Loopback,
    /// These, with any port or with the one that is given.
    Listed(&'a [String]),
}

impl<'a> AllowedHosts<'a> {
    /// Those of the settings. A service that only this machine can reach, that needs no key, and that no proxy is said
    /// to be before, is for this machine.
    pub fn of(config: &'a Config, needs_key: bool) -> Self {
        let hosts = &config.access.allowed_hosts;
        let is_local = config.listen.ip().is_loopback() && config.limits.trusted_proxies.is_empty();
        match (hosts.is_empty(), is_local && !needs_key) {
            (false, _) => Self::Listed(hosts),
            (true, true) => Self::Loopback,
            (true, false) => Self::All,
        }
    }

    /// Whether `host` is one of them. Requests of HTTP/1.0 may name none; browsers do not send them.
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

/// Whether `host` is the allowed one, which may leave the port open.
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
