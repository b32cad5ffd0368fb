//! The address of a Redis.

use super::scripts::ScriptServer;
use redis::cluster::ClusterClient;
use redis::{Client, ErrorKind};
use std::sync::Arc;
use std::time::Duration;

/// The text is no address of a Redis.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RedisAddressError(String);

/// The address of a Redis. It may hold a password, so its debug output shows nothing.
#[derive(Clone)]
pub struct RedisAddress(pub(super) Kind);

#[derive(Clone)]
pub(super) enum Kind {
    /// One server.
    Server(Box<Client>),
    /// Some nodes of a cluster, which tell the others.
    Cluster(Box<ClusterClient>),
    /// A program that stands in for a Redis.
    Given(Arc<dyn ScriptServer>),
}

impl RedisAddress {
    /// Reads `redis://[user:password@]host[:port][/database]`, with `rediss` for TLS, `valkey` and `valkeys` with the
    /// same meanings, `unix:///path`, or `redis-cluster://…`, `rediss-cluster://…` and so on, with further nodes as
    /// `host:port` after commas. Calls to a cluster take at most `timeout`.
    ///
    /// # Errors
    /// The text is none of these. The error does not show the text, which may have a password in it.
    pub fn parse(text: &str, timeout: Duration) -> Result<Self, RedisAddressError> {
        let failed = |error: redis::RedisError| {
            let reason = match error.kind() {
                ErrorKind::InvalidClientConfig => error.detail().unwrap_or("").to_owned(),
                kind => format!("{kind:?}"),
            };
            RedisAddressError(format!("no address of a store: {reason}"))
        };
        // The parser of URLs would drop what follows a `#`, and the host with it.
        if text.contains('#') {
            let reason = "no address of a store: a `#` in a password is written `%23`";
            return Err(RedisAddressError(reason.to_owned()));
        }
        let Some((scheme, rest)) = text.split_once("-cluster://") else {
            let client = Client::open(text).map_err(failed)?;
            return Ok(Self(Kind::Server(Box::new(client))));
        };
        let (login, nodes) = match rest.rsplit_once('@') {
            Some((login, nodes)) => (format!("{login}@"), nodes),
            None => (String::new(), rest),
        };
        let nodes = nodes.trim_end_matches('/').split(',');
        let nodes = nodes.map(|node| format!("{scheme}://{login}{node}"));
        let cluster = ClusterClient::builder(nodes)
            .connection_timeout(timeout)
            .response_timeout(timeout)
            .retries(1)
            .build();
        Ok(Self(Kind::Cluster(Box::new(cluster.map_err(failed)?))))
    }

    /// The address of a program that stands in for a Redis.
    pub fn of(server: Arc<dyn ScriptServer>) -> Self {
        Self(Kind::Given(server))
    }
}

impl std::fmt::Debug for RedisAddress {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("RedisAddress")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_of_servers_and_clusters_are_taken_and_passwords_are_not_shown() {
        let parse = |text| RedisAddress::parse(text, Duration::from_secs(1));
        for text in [
            "redis://localhost",
            "valkey://:secret@10.0.0.1:7000/3",
            "unix:///run/redis.sock",
        ] {
            assert!(
                matches!(parse(text), Ok(RedisAddress(Kind::Server(_)))),
                "{text}"
            );
        }
        for text in [
            "redis-cluster://:secret@a:7000,b:7001",
            "valkey-cluster://a.example.org",
        ] {
            assert!(
                matches!(parse(text), Ok(RedisAddress(Kind::Cluster(_)))),
                "{text}"
            );
        }
        let with_tls = parse("rediss://user:secret@example.org");
        assert_eq!(with_tls.is_ok(), cfg!(feature = "tls"));
        for text in [
            "localhost:6379",
            "http://localhost",
            "redis://:secret@a:port",
            "redis://:secret#@localhost",
            "redis://user:secret@b#c@localhost",
            "redis-cluster://:secret#@a:7000,b:7001",
            "",
        ] {
            let error = parse(text).unwrap_err().to_string();
            assert!(!error.contains("secret"), "{error}");
        }
    }
}
