//! The settings of the store that replicas share.

use super::settings::{ConfigError, Secret, in_range, moment, positive, settings};
use bagtrack_sessions::{RedisStore, SessionStore, StoreAddress};
use std::sync::Arc;
use std::time::Duration;

settings! {
    /// The store that replicas share. Without one, sessions live in this process only.
    pub struct StoreConfig {
        /// Where sessions are stored: `redis://[user:password@]host[:port][/database]`, `valkey` alike, or
        /// `redis-cluster://host:port,host:port`. `rediss` and `valkeys` for TLS.
        store: Option<Secret> = None, as "URL";
        /// Write a session's state at every so many frames. Answers say `Checkpoint: N`; after the end of a replica, its
        /// clients send the frames after N again. More than 1 needs a load balancer that keeps a session at one replica.
        store_every: u64 = 1, positive;
        /// Time for a call to the store.
        store_timeout: Duration = Duration::from_secs(1), moment;
        /// What the keys in the store begin with. Services that share a server without sharing sessions have different
        /// ones.
        store_prefix: String = "bagtrack".to_owned();
    }
}

impl StoreConfig {
    /// Checks the address.
    pub(super) fn check_address(&self) -> Result<(), ConfigError> {
        let address = |text: &Secret| StoreAddress::parse(text.text(), self.store_timeout).is_ok();
        let held = in_range(
            self.store.as_ref().is_none_or(address),
            "an address like redis://localhost:6379; rediss is in builds with the feature tls",
        );
        ConfigError::check("store", held)
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
