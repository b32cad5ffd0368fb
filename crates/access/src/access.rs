//! The keys and secrets of a running service, checked at its start.

use super::keys::{ApiKeys, KeysError};
use super::token::TokenKeys;
use bagtrack_config::AccessConfig;
use bagtrack_sessions::{MacKeys, SNAPSHOT_KEY_CONTEXT};
use std::net::SocketAddr;
use std::sync::Arc;

const MIN_SECRET_BYTES: usize = 16;

/// Why the service does not start.
#[derive(Debug, thiserror::Error)]
pub enum AccessError {
    /// The API keys cannot be read.
    #[error(transparent)]
    Keys(#[from] KeysError),
    /// The service would be open to a network.
    #[error(
        "{0} can be reached from other machines, and there are no API keys: give some (--api-keys-file, \
         BAGTRACK_API_KEYS), or say that everybody may use the service (--no-auth, BAGTRACK_NO_AUTH=true)"
    )]
    Open(SocketAddr),
    /// Two settings contradict each other.
    #[error(
        "there are API keys, and --no-auth (BAGTRACK_NO_AUTH) says that none is needed: leave one of them out"
    )]
    Contradiction,
    /// A secret can be guessed.
    #[error(
        "--snapshot-keys (BAGTRACK_SNAPSHOT_KEYS) and --metrics-key (BAGTRACK_METRICS_KEY) must be secrets of at least \
         {MIN_SECRET_BYTES} characters"
    )]
    ShortSecret,
}

/// The keys and secrets of a running service.
#[derive(Debug)]
pub struct Access {
    /// The API keys.
    pub keys: ApiKeys,
    /// What session tokens are signed with.
    pub tokens: TokenKeys,
    /// What snapshots are signed with.
    pub snapshots: Arc<MacKeys>,
}

impl Access {
    /// The keys and secrets of these settings, for a service that listens on this address.
    ///
    /// # Errors
    /// See [`AccessError`].
    pub fn load(config: &AccessConfig, listen: SocketAddr) -> Result<Self, AccessError> {
        let keys = ApiKeys::load(&config.api_keys, config.api_keys_file.as_deref())?;
        match (keys.are_needed(), config.no_auth) {
            (true, true) => return Err(AccessError::Contradiction),
            (false, false) if !listen.ip().is_loopback() => return Err(AccessError::Open(listen)),
            _ => {}
        }
        let secrets = &config.snapshot_keys;
        let is_short = |secret: &_| AsRef::<[u8]>::as_ref(secret).len() < MIN_SECRET_BYTES;
        if secrets.iter().chain(&config.metrics_key).any(is_short) {
            return Err(AccessError::ShortSecret);
        }
        let mut snapshots = MacKeys::new(SNAPSHOT_KEY_CONTEXT, secrets);
        if config.unsigned_snapshots {
            snapshots = snapshots.accepting_unsigned(!secrets.is_empty());
        }
        Ok(Self {
            keys,
            tokens: TokenKeys::new(secrets),
            snapshots: Arc::new(snapshots),
        })
    }
}
