//! Why the service cannot start: each text names the setting to change.

use bagtrack_access::AccessError;
use bagtrack_config::ConfigError;
#[cfg(feature = "tls")]
use bagtrack_net::CertificateError;
use bagtrack_sessions::FileStoreError;
use std::io;
use std::net::SocketAddr;

/// Why the service could not start.
#[derive(Debug, thiserror::Error)]
pub enum BindError {
    /// A setting is out of its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The keys cannot be used, or the service would be open to a network.
    #[error(transparent)]
    Access(#[from] AccessError),
    /// There is no certificate to show, where the settings name one.
    #[cfg(feature = "tls")]
    #[error(transparent)]
    Certificate(#[from] CertificateError),
    /// The address cannot be listened on.
    #[error("cannot listen on {address} (--listen, BAGTRACK_LISTEN): {source}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// The folder of the store cannot be used.
    #[error("{0} (--store, BAGTRACK_STORE)")]
    Store(#[from] FileStoreError),
    /// The network of the second opinion cannot be used.
    #[error("{0} (--model, BAGTRACK_MODEL)")]
    Model(String),
    /// The system gives no threads.
    #[error("cannot start the workers (--workers, BAGTRACK_WORKERS): {0}")]
    Workers(io::Error),
}
