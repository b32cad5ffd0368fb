//! The settings of the store that replicas share.

use super::access::Secret;
use bagtrack_sessions::{RedisStore, SessionStore, StoreAddress};
use std::sync::Arc;
use std::time::Duration;

use super::flag_values::parse_duration;

use super::limits::shown;

/// The store that replicas share. Without one, sessions live in this process only.
#[derive(Debug, Clone, clap::Args)]
pub struct StoreConfig {
    /// Where sessions are stored: `redis://[user:password@]host[:port][/database]`, `valkey` alike, or
    /// `redis-cluster://host:port,host:port`. `rediss` and `valkeys` for TLS.
    #[arg(
        long,
        env = "BAGTRACK_STORE",
        hide_env_values = true,
        value_name = "URL"
    )]
    pub store: Option<Secret>,
    /// Write a session's state at every so many frames. Answers say `Checkpoint: N`; after the end of a replica, its
    /// clients send the frames after N again. More than 1 needs a load balancer that keeps a session at one replica.
    #[arg(
        long, env = "BAGTRACK_STORE_EVERY",
        default_value_t = StoreConfig::default().store_every
    )]
    pub store_every: u64,
    /// Time for a call to the store.
    #[arg(
        long, env = "BAGTRACK_STORE_TIMEOUT",
        default_value = shown(StoreConfig::default().store_timeout),
        value_parser = parse_duration
    )]
    pub store_timeout: Duration,
    /// What the keys in the store begin with. Services that share a server without sharing sessions have different
    /// ones.
    #[arg(
        long, env = "BAGTRACK_STORE_PREFIX",
        default_value_t = StoreConfig::default().store_prefix
    )]
    pub store_prefix: String,
}

impl Default for StoreConfig {
    fn default() -> Self {
        Self {
            store: None,
            store_every: 1,
            store_timeout: Duration::from_secs(1),
            store_prefix: "bagtrack".to_owned(),
        }
    }
}

impl StoreConfig {
    /// Each setting that has a range: its flag, whether its value is inside, and what the range is. `moment` is the
    /// range of durations.
    pub(super) fn checks(
        &self,
        moment: &std::ops::RangeInclusive<Duration>,
    ) -> [(&'static str, bool, &'static str); 3] {
        let address = |text: &Secret| StoreAddress::parse(text.text(), self.store_timeout).is_ok();
        [
            (
                "store",
                self.store.as_ref().is_none_or(address),
                "an address like redis://localhost:6379; rediss is in builds with the feature tls",
            ),
            ("store-every", self.store_every >= 1, "at least 1"),
            (
                "store-timeout",
                moment.contains(&self.store_timeout),
                "between 1ms and 1 year",
            ),
        ]
    }
}

/// The store of these settings, where they name one.
pub async fn connect(config: &StoreConfig) -> Option<Arc<dyn SessionStore>> {
    let text = config.store.as_ref()?.text();
    let address = StoreAddress::parse(text, config.store_timeout).ok()?;
    let store = RedisStore::connect(address, &config.store_prefix, config.store_timeout).await;
    let store = store.inspect_err(|error| tracing::error!(%error, "no store"));
    Some(Arc::new(store.ok()?))
}
