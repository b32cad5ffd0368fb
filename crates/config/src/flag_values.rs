//! Settings as they are written on the command line and in the environment.

use ipnet::IpNet;
use std::net::{IpAddr, SocketAddr, ToSocketAddrs};
use std::str::FromStr;
use std::time::Duration;

/// Reads a whole number, which has no unit.
pub(super) fn parse_whole<N: FromStr>(text: &str) -> Result<N, String> {
    let bits = 8 * size_of::<N>();
    let read = text.parse();
    read.map_err(|_| format!("it must be a whole number from 0 to 2^{bits} - 1, without a unit"))
}

/// Reads a duration: `10m`, `30s`, `500ms`, or a number of seconds alone.
///
/// # Errors
/// The text has none of these forms.
pub fn parse_duration(text: &str) -> Result<Duration, humantime::DurationError> {
    match text.parse() {
        Ok(seconds) => Ok(Duration::from_secs(seconds)),
        Err(_) => humantime::parse_duration(text),
    }
}

/// Reads an address to listen on: `127.0.0.1:8080`, `[::1]:8080`, or a host's name with a port. Of several addresses of
/// a name the first one of IPv4 counts.
///
/// # Errors
/// The text has no port, or its name has no address.
pub fn parse_listen(text: &str) -> Result<SocketAddr, String> {
    let usage = "an address with a port, like 127.0.0.1:8080 or localhost:8080";
    let found = text
        .to_socket_addrs()
        .map_err(|error| format!("it must be {usage}: {error}"))?;
    let found: Vec<SocketAddr> = found.collect();
    let first = found.iter().find(|address| address.is_ipv4());
    let address = first.or(found.first()).copied();
    address.ok_or_else(|| format!("it must be {usage}: the name has no address"))
}

/// Reads a network, or a single address.
pub(super) fn parse_network(text: &str) -> Result<IpNet, String> {
    let address = || text.parse().map(|address: IpAddr| address.into());
    let network = text.parse().or_else(|_| address());
    network.map_err(|_| "neither an address nor a network like 10.0.0.0/8".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_alone_is_seconds() {
        let read = |text| parse_duration(text).ok();
        assert_eq!(read("10"), Some(Duration::from_secs(10)));
        assert_eq!(read("10m"), Some(Duration::from_secs(600)));
        assert_eq!(read("500ms"), Some(Duration::from_millis(500)));
        assert_eq!((read("-1"), read("ten"), read("")), (None, None, None));
    }

    #[test]
    fn what_is_no_whole_number_is_told_what_one_is() {
        assert_eq!(parse_whole::<u32>("4096"), Ok(4096));
        for text in ["zwei", "5MB", "1.5", "-1", "4294967296", ""] {
            let refused = parse_whole::<u32>(text).unwrap_err();
            assert!(
                refused.contains("a whole number from 0 to 2^32 - 1"),
                "{text}: {refused}"
            );
        }
    }

    #[test]
    fn a_name_is_taken_as_its_address() {
        let local = parse_listen("localhost:8080").unwrap();
        assert!(local.ip().is_loopback() && local.port() == 8080);
        assert_eq!(parse_listen("0.0.0.0:1").unwrap().to_string(), "0.0.0.0:1");
        assert_eq!(parse_listen("[::1]:1").unwrap().to_string(), "[::1]:1");
        for text in ["localhost", "8080", "", "127.0.0.1:99999"] {
            assert!(parse_listen(text).is_err(), "{text}");
        }
    }
}
