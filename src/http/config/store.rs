//! The settings of the store that replicas share.

use super::access::Secret;
use crate::sessions::{Store, StoreAddress};
use std::time::Duration;

#[cfg(feature = "cli")]
use super::flag_values::parse_duration;

#[cfg(feature = "cli")]
use super::limits::shown;

/// What is done with a frame while the store gives no answer.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum StoreMode {
    /// It is refused.
    #[default]
    Strict,
    /// It is tracked in memory, and its answer says `Durable: false`.
    BestEffort,
}

/// The store that replicas share. Without one, sessions live in this process only.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct StoreConfig {
    /// Where sessions are stored: `redis://[user:password@]host[:port][/database]`, `valkey` alike, or
    /// `redis-cluster://host:port,host:port`. `rediss` and `valkeys` for TLS.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            env = "BAGTRACK_STORE",
            hide_env_values = true,
            value_name = "URL"
        )
    )]
    pub store: Option<Secret>,
    /// Write a session's state at every so many frames. Answers say `Checkpoint: N`; after the end of a replica, its
    /// clients send the frames after N again. More than 1 needs a load balancer that keeps a session at one replica.
    #[cfg_attr(feature = "cli", arg(
        long, env = "BAGTRACK_STORE_EVERY",
        default_value_t = StoreConfig::default().store_every
    ))]
    pub store_every: u64,
    /// Time for a call to the store.
    #[cfg_attr(feature = "cli", arg(
        long, env = "BAGTRACK_STORE_TIMEOUT",
        default_value = shown(StoreConfig::default().store_timeout),
        value_parser = parse_duration
    ))]
    pub store_timeout: Duration,
    /// While the store gives no answer: `strict` refuses frames, `best-effort` tracks on and says `Durable: false`.
    #[cfg_attr(feature = "cli", arg(
        long, env = "BAGTRACK_STORE_MODE", value_enum,
        default_value_t = StoreConfig::default().store_mode
    ))]
    pub store_mode: StoreMode,
    /// What the keys in the store begin with. Services that share a server without sharing sessions have different
    /// ones.
    #[cfg_attr(feature = "cli", arg(
        long, env = "BAGTRACK_STORE_PREFIX",
        default_value_t = StoreConfig::default().store_prefix
    ))]
    pub store_prefix: String,
}

impl Default for StoreConfig {
    fn default() -> Self {
        Self {
            store: None,
            store_every: 1,
            store_timeout: Duration::from_secs(1),
            store_mode: StoreMode::Strict,
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

/// The store, and how it is used.
#[derive(Debug, Clone)]
pub struct SharedStore {
    /// The store.
    pub calls: Store,
    /// The state is written at every so many frames.
    pub every: u64,
    /// Whether frames are tracked while the store gives no answer.
    pub best_effort: bool,
}

impl SharedStore {
    /// The store of these settings, where they name one.
    pub async fn connect(config: &StoreConfig) -> Option<Self> {
        let text = config.store.as_ref()?.text();
        let address = StoreAddress::parse(text, config.store_timeout).ok()?;
        let store = Store::connect(address, &config.store_prefix, config.store_timeout).await;
        let calls = store
            .inspect_err(|error| tracing::error!(%error, "no store"))
            .ok()?;
        Some(Self {
            calls,
            every: config.store_every,
            best_effort: config.store_mode == StoreMode::BestEffort,
        })
    }
}
