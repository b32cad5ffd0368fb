//! The settings of the store: one that replicas share, or one of this process in a folder.

use super::settings::{ConfigError, Secret, in_range, moment, positive, settings};
#[cfg(feature = "redis")]
use bagtrack_sessions::RedisStore;
use bagtrack_sessions::{Clock, Durability, FileStore, FileStoreError, SessionStore, StoreAddress};
use std::sync::Arc;
use std::time::Duration;

settings! {
    /// Where sessions are kept. Without a store they live in this process only, and end with it.
    pub struct StoreConfig {
        # "Store"
        /// Where sessions are stored: `file:DIR` for one process, which goes on from there after a restart. For
        /// replicas `redis://[user:password@]host[:port][/database]`, `valkey` alike, or
        /// `redis-cluster://host:port,host:port`. `rediss` and `valkeys` for TLS.
        store: Option<Secret> = None, as "URL";
        /// When a store in a folder is synced to the disk: at least once in this time, or before `each` answer. A
        /// process that is killed loses nothing; a power cut may lose what was answered since the last sync.
        durability: Durability = Durability::default();
        /// Write a session's state at every so many frames. Answers say `Checkpoint: N`; after the end of a replica,
        /// its clients send the frames after N again. More than 1 needs a load balancer that keeps a session at one
        /// replica.
        store_every: u64 = 1, positive;
        /// Time for a call to the store.
        store_timeout: Duration = Duration::from_secs(1), moment;
        /// What the keys in the store begin with. Services that share a server without sharing sessions have different
        /// ones.
        store_prefix: String = "bagtrack".to_owned();
    }
}

impl StoreConfig {
    pub(super) fn is_in_folder(&self) -> bool {
        matches!(self.address(), Some(StoreAddress::File(_)))
    }

    /// Whether settings of a store are given, but no store.
    pub fn lacks_store(&self) -> bool {
        fn of(it: &StoreConfig) -> (Durability, u64, Duration, &str) {
            let prefix = &it.store_prefix;
            (it.durability, it.store_every, it.store_timeout, prefix)
        }
        self.store.is_none() && of(self) != of(&Self::default())
    }

    pub(super) fn check_address(&self) -> Result<(), ConfigError> {
        let held = in_range(
            self.store.is_none() || self.address().is_some(),
            "file:DIR, or an address like redis://localhost:6379, which is in builds with the feature redis, and rediss \
             in those with tls; a password has `/`, `?`, `#`, `@` and `%` as `%2F`, `%3F`, `%23`, `%40` and `%25`",
        );
        ConfigError::check("store", held)
    }

    fn address(&self) -> Option<StoreAddress> {
        let text = self.store.as_ref().map(Secret::text)?;
        StoreAddress::parse(text, self.store_timeout).ok()
    }

    /// The store that these settings, which were checked, name; `None` where they name none. Sessions expire by
    /// `clock`.
    ///
    /// # Errors
    /// The named folder cannot be used. A Redis that is away is no error: it may come later.
    pub async fn connect(
        &self,
        clock: Clock,
    ) -> Result<Option<Arc<dyn SessionStore>>, FileStoreError> {
        let timeout = self.store_timeout;
        Ok(match self.address() {
            None => None,
            Some(StoreAddress::File(folder)) => {
                let store = FileStore::open(&folder, self.durability, timeout, clock)?;
                Some(Arc::new(store))
            }
            #[cfg(feature = "redis")]
            Some(StoreAddress::Redis(address)) => {
                let store = RedisStore::connect(address, &self.store_prefix, timeout, clock).await;
                let store = store.inspect_err(|error| tracing::error!(%error, "no store"));
                store.ok().map(|store| Arc::new(store) as _)
            }
        })
    }
}
