//! The service at its address: it listens, serves and ends.
//!
//! On shutdown, busy connections get a bounded time to end. Each reason why the service cannot start names the setting
//! to change.

use super::connections::{ConnectionService, accept};
use super::service::Service;
use crate::http::state::Parts;
use axum::Router;
#[cfg(feature = "jwt")]
use bagtrack_access::JwtError;
use bagtrack_access::{Access, AccessError, ApiKeys};
use bagtrack_cli::ModelFiles;
#[cfg(feature = "tls")]
use bagtrack_config::TlsConfig;
use bagtrack_config::{Config, ConfigError};
use bagtrack_net::Security;
#[cfg(feature = "tls")]
use bagtrack_net::{Certificate, CertificateError};
use bagtrack_sessions::clock::timeout;
use bagtrack_sessions::{Clock, Executor, FileStoreError};
use std::io;
use std::net::SocketAddr;
use std::pin::pin;
use std::time::SystemTime;
use tokio::net::TcpListener;
use tokio::sync::watch;

/// Most bytes of an answer that the system buffers before it sends them. With more, a client that reads slowly but
/// steadily would for a long time seem to take nothing.
#[cfg(target_os = "linux")]
const MAX_UNSENT: u32 = 64 << 10;

/// How a service ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shutdown {
    /// After the configured delay, in which sessions are still served.
    Gradual,
    /// Without the delay.
    Prompt,
}

impl From<()> for Shutdown {
    fn from((): ()) -> Self {
        Self::Gradual
    }
}

/// Why the service could not start.
#[derive(Debug, thiserror::Error)]
pub enum BindError {
    /// A setting is out of its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The keys cannot be used, or the service would be open to a network.
    #[error(transparent)]
    Access(#[from] AccessError),
    /// The certificate that the settings name cannot be used.
    #[cfg(feature = "tls")]
    #[error(transparent)]
    Certificate(#[from] CertificateError),
    /// The address cannot be listened on.
    #[error("cannot listen on {address} (--listen, BAGTRACK_LISTEN): {source}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// The system's error.
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

/// The service, bound to its address.
#[derive(Debug)]
pub struct Application {
    listener: TcpListener,
    security: Security,
    service: Service,
    extra: Router,
}

impl Application {
    /// Listens on the configured address.
    ///
    /// # Errors
    /// See [`BindError`].
    pub async fn bind(config: Config) -> Result<Self, BindError> {
        Self::bind_with_clock(config, Clock::default()).await
    }

    /// Like [`Self::bind`], with the clock that sessions expire by.
    ///
    /// # Errors
    /// See [`BindError`].
    pub async fn bind_with_clock(config: Config, clock: Clock) -> Result<Self, BindError> {
        config.validate()?;
        let address = config.listen;
        let access = load_access(&config, clock.wall(clock.now())).await?;
        #[cfg(feature = "tls")]
        let security = security(&config.tls, clock.wall(clock.now()))?;
        #[cfg(not(feature = "tls"))]
        let security = Security::Plain;
        let listener = listen(address).await;
        let listener = listener.map_err(|source| BindError::Listen { address, source })?;
        let store = config.store.connect(clock.clone()).await?;
        let load = |files: &ModelFiles| files.load(config.model_in_doubt);
        let expert = config.model.as_ref().map(load);
        let expert = expert.transpose().map_err(BindError::Model)?;
        let executor = Executor::threads(config.worker_count()).map_err(BindError::Workers)?;
        let parts = Parts {
            clock,
            store,
            expert,
            executor,
        };
        Ok(Self {
            listener,
            security,
            service: Service::of(config, access, parts),
            extra: Router::new(),
        })
    }

    /// The address that the service listens on.
    ///
    /// # Errors
    /// The system does not tell the address.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// How the service's address begins: `http`, or `https` where the settings name a certificate.
    pub fn scheme(&self) -> &'static str {
        self.security.scheme()
    }

    /// A function that reads the certificate again, and may block; `None` without TLS.
    #[cfg(feature = "tls")]
    pub fn certificate(
        &self,
    ) -> Option<impl Fn() -> Result<(), CertificateError> + Send + Sync + use<>> {
        let Security::Tls(certificate) = &self.security else {
            return None;
        };
        let (certificate, state) = (certificate.clone(), self.service.state.clone());
        Some(move || certificate.reload(state.now()))
    }

    /// The API keys of the service, shared with it, to read them again.
    pub fn api_keys(&self) -> ApiKeys {
        self.service.state.access.keys.clone()
    }

    /// A function that reads the keys of the issuer of tokens again, and may block. It returns their number. `None`
    /// where the settings name no issuer.
    #[cfg(feature = "jwt")]
    pub fn issuer_keys(
        &self,
    ) -> Option<impl Fn() -> Result<usize, JwtError> + Send + Sync + use<>> {
        let state = self.service.state.clone();
        let verifier = state.access.jwt.clone()?;
        Some(move || verifier.reload(state.now()))
    }

    /// Serves these routes too. Their requests pass through the middleware of all requests, but no check of a key, of
    /// the origin or of the host.
    pub fn with_routes(mut self, routes: Router) -> Self {
        self.extra = self.extra.merge(routes);
        self
    }

    /// Serves until `shutdown` is ready. Then `/readyz` answers 503 at once, no session can be opened, and all answers
    /// are marked `Draining: true`. After the configured delay no connection is accepted any more, and open requests
    /// get the configured time to end; then they are cut off. Returns whether all of them ended in time.
    pub async fn serve<S: Into<Shutdown>>(self, shutdown: impl Future<Output = S>) -> bool {
        let Self {
            listener,
            security,
            service,
            extra,
        } = self;
        let state = service.state.clone();
        let config = &state.config;
        let (ending, _) = watch::channel(false);
        let (keep_alive, cut_off) = watch::channel(());
        let sweeper = tokio::spawn({
            let service = service.clone();
            async move { service.sweep().await }
        });
        {
            let routes = service.routes(extra);
            let services = [
                ConnectionService::new(state.clone(), security.clone(), routes),
                ConnectionService::for_probes(state.clone(), security),
            ];
            let accepting = accept(&listener, &state, services, &ending, cut_off);
            let mut accepting = pin!(accepting);
            tokio::select! {
                () = &mut accepting => {}
                how = shutdown => {
                    tracing::info!("shutting down");
                    service.drain();
                    tokio::spawn({
                        let service = service.clone();
                        async move { service.flush().await }
                    });
                    // New connections are still served: a load balancer asks for /readyz on them.
                    if how.into() == Shutdown::Gradual {
                        let _ = timeout(config.shutdown_delay, accepting).await;
                    }
                }
            }
        }
        drop(listener);
        sweeper.abort();
        ending.send_replace(true);
        // Each connection, and each stream that took one over, holds a receiver of `ending`.
        let ended = timeout(config.shutdown_timeout, ending.closed()).await;
        drop(keep_alive);
        service.flush().await;
        ended.is_ok()
    }
}

/// Listens. Accepted sockets inherit the options of the listener.
async fn listen(address: SocketAddr) -> io::Result<TcpListener> {
    let listener = TcpListener::bind(address).await?;
    #[cfg(target_os = "linux")]
    socket2::SockRef::from(&listener).set_tcp_notsent_lowat(MAX_UNSENT)?;
    Ok(listener)
}

/// Reads the keys on a thread that may block: they may come from a slow file system, or over the network.
async fn load_access(config: &Config, now: SystemTime) -> Result<Access, AccessError> {
    let (access, listen) = (config.access.clone(), config.listen);
    let loaded = tokio::task::spawn_blocking(move || Access::load(&access, listen, now)).await;
    // Nobody cancels the task, so it can only have panicked.
    loaded.unwrap_or_else(|panic| std::panic::resume_unwind(panic.into_panic()))
}

/// TLS where the settings name a certificate, else plain TCP.
#[cfg(feature = "tls")]
fn security(tls: &TlsConfig, now: SystemTime) -> Result<Security, CertificateError> {
    let certificate = Certificate::load(tls.tls_cert.as_deref(), tls.tls_key.as_deref(), now)?;
    Ok(certificate.map_or(Security::Plain, Security::Tls))
}
