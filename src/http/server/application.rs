//! Accepting connections, and ending.
//!
//! `axum::serve` has no time limit for request heads: a client that sends half a line holds its connection for ever.
//! hyper's connection builder has one. Connections are [counted](Connections), too. On shutdown, busy ones get a
//! bounded time to end.

use super::bind_error::BindError;
use super::connection_service::ConnectionService;
use super::refusal;
use super::service::Service;
use crate::http::problems::problem::Problem;
use crate::http::state::{AppState, Parts};
use axum::Router;
#[cfg(feature = "jwt")]
use bagtrack_access::JwtError;
use bagtrack_access::{Access, AccessError, ApiKeys};
use bagtrack_cli::ModelFiles;
#[cfg(feature = "tls")]
use bagtrack_config::TlsConfig;
use bagtrack_config::{Config, PROBE_CONNECTIONS};
#[cfg(feature = "tls")]
use bagtrack_net::{Certificate, CertificateError};
use bagtrack_net::{ConnectionHold, Connections, NoRoom, Security, is_trusted};
use bagtrack_sessions::clock::{sleep, timeout};
use bagtrack_sessions::{Clock, Executor};
use std::io::{self, Write};
use std::net::SocketAddr;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;
use std::time::SystemTime;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;

/// Bytes of an answer that the system takes while it waits to send them. With more, a client that reads slowly but
/// steadily would for a long time seem to take nothing.
#[cfg(target_os = "linux")]
const MAX_UNSENT: u32 = 64 << 10;
/// How long to wait before looking for room again.
const RETRY: Duration = Duration::from_millis(100);
/// Most connections for probes alone of one address.
const PROBE_CONNECTIONS_OF_ADDRESS: usize = 8;

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
    /// What the system says.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// How the service's address begins: `http`, or `https` where the settings name a certificate.
    pub fn scheme(&self) -> &'static str {
        self.security.scheme()
    }

    /// What reads the certificate again, where there is one. It may block.
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

    /// The API keys, to read them again.
    pub fn api_keys(&self) -> ApiKeys {
        self.service.state.access.keys.clone()
    }

    /// What reads the keys of the issuer of tokens again, where one is named. It gives how many there are, and may
    /// block.
    #[cfg(feature = "jwt")]
    pub fn issuer_keys(
        &self,
    ) -> Option<impl Fn() -> Result<usize, JwtError> + Send + Sync + use<>> {
        let state = self.service.state.clone();
        let verifier = state.access.jwt.clone()?;
        Some(move || verifier.reload(state.now()))
    }

    /// Serves these routes too: behind the middleware that all requests pass, but not behind those that ask for a key,
    /// or check the origin and the host.
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
        // Each connection, and each stream that took one over, holds a receiver.
        let ended = timeout(config.shutdown_timeout, ending.closed()).await;
        drop(keep_alive);
        service.flush().await;
        ended.is_ok()
    }
}

/// Listens. The sockets that it accepts have its options.
async fn listen(address: SocketAddr) -> io::Result<TcpListener> {
    let listener = TcpListener::bind(address).await?;
    #[cfg(target_os = "linux")]
    socket2::SockRef::from(&listener).set_tcp_notsent_lowat(MAX_UNSENT)?;
    Ok(listener)
}

/// Reads the keys. They may come from a slow file system, or over the network.
async fn load_access(config: &Config, now: SystemTime) -> Result<Access, AccessError> {
    let (access, listen) = (config.access.clone(), config.listen);
    let loaded = tokio::task::spawn_blocking(move || Access::load(&access, listen, now)).await;
    // Nobody cancels it.
    loaded.unwrap_or_else(|panic| std::panic::resume_unwind(panic.into_panic()))
}

/// With TLS where the settings name a certificate.
#[cfg(feature = "tls")]
fn security(tls: &TlsConfig, now: SystemTime) -> Result<Security, CertificateError> {
    let certificate = Certificate::load(tls.tls_cert.as_deref(), tls.tls_key.as_deref(), now)?;
    Ok(certificate.map_or(Security::Plain, Security::Tls))
}

/// Accepts connections for ever. The first service has them, and the second one those over the share of their address.
/// They end when `cut_off` loses its sender.
async fn accept(
    listener: &TcpListener,
    state: &AppState,
    services: [ConnectionService; 2],
    ending: &watch::Sender<bool>,
    cut_off: watch::Receiver<()>,
) {
    let (config, limits) = (&state.config, &state.config.limits);
    let of_address = limits.client_connections;
    let of_address = of_address.unwrap_or(config.max_connections.div_ceil(4));
    let shed = state.metrics.shed_connections.clone();
    let connections = Connections::new(config.max_connections, of_address, shed.clone());
    let probes = Connections::new(PROBE_CONNECTIONS, PROBE_CONNECTIONS_OF_ADDRESS, shed);
    let [service, probe_service] = services.map(Arc::new);
    loop {
        let (stream, peer) = match listener.accept().await {
            Ok(accepted) => accepted,
            Err(error) => {
                // Mostly too many open files: wait for connections to end.
                tracing::warn!(%error, "cannot accept");
                sleep(RETRY).await;
                continue;
            }
        };
        let is_proxy = is_trusted(peer.ip().to_canonical(), &limits.trusted_proxies);
        let permit = loop {
            match connections.enter(peer.ip(), is_proxy) {
                Err(NoRoom::All) => {
                    connections.freed.notified().await;
                }
                other => break other,
            }
        };
        let (permit, service) = match permit {
            Ok(permit) => (permit, service.clone()),
            Err(_) => match probes.enter(peer.ip(), false) {
                Ok(permit) => (permit, probe_service.clone()),
                Err(_) => {
                    refuse(stream, peer, state, service.has_tls());
                    continue;
                }
            },
        };
        let hold = ConnectionHold::new(permit, ending.subscribe(), cut_off.clone());
        tokio::spawn(async move { service.serve(stream, peer, hold).await });
    }
}

/// Tells a client that it has too many connections, as far as its system takes that at once. With TLS the connection is
/// closed without a word: what is said before the handshake looks like a fault of the service.
fn refuse(stream: TcpStream, peer: SocketAddr, state: &AppState, has_tls: bool) {
    let problem = Problem::too_many_connections();
    let answer = refusal::answer_of(&problem, peer.ip(), &state.metrics);
    if let Ok(mut stream) = stream.into_std()
        && !has_tls
    {
        // It does not wait: the stream is not in blocking mode.
        let _ = stream.write(&answer);
    }
}
