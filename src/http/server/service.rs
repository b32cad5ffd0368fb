//! The service without a network: its routes, and its work in the background.

use super::application::BindError;
use super::connections::ConnectionService;
use crate::http::server::router::router;
use crate::http::state::{AppState, Parts};
use axum::{Extension, Router};
use bagtrack_access::Access;
use bagtrack_config::Config;
use bagtrack_net::Peer;
use bagtrack_net::Security;
use bagtrack_sessions::clock::interval;
use std::net::SocketAddr;
use std::time::Duration;

/// The service without a listener, for simulations that bring the requests themselves. Clones share one state.
#[derive(Debug, Clone)]
pub struct Service {
    pub(super) state: AppState,
}

impl Service {
    /// The service with these settings.
    ///
    /// # Errors
    /// The settings or the keys cannot be used.
    pub fn new(config: Config, parts: Parts) -> Result<Self, BindError> {
        config.validate()?;
        let access = Access::load(
            &config.access,
            config.listen,
            parts.clock.wall(parts.clock.now()),
        )?;
        Ok(Self::of(config, access, parts))
    }

    /// Like [`Self::new`], with settings and keys that were checked.
    pub(super) fn of(config: Config, access: Access, parts: Parts) -> Self {
        Self {
            state: AppState::new(config, access, parts),
        }
    }

    /// The routes, as a client at this address meets them.
    pub fn router(&self, client: SocketAddr) -> Router {
        self.routes(Router::new()).layer(Extension(Peer(client)))
    }

    /// Serves connections without TLS that the caller has accepted.
    pub fn connections(&self) -> ConnectionService {
        let routes = self.routes(Router::new());
        ConnectionService::new(self.state.clone(), Security::Plain, routes)
    }

    /// The routes of the service, with those of `extra` beside them.
    pub(super) fn routes(&self, extra: Router) -> Router {
        router(self.state.clone(), extra)
    }

    /// The service is about to end: no session is opened from now on, and all answers say so.
    pub fn drain(&self) {
        self.state.service.drain();
    }

    /// Writes to the store the states of sessions that only this process has.
    pub async fn flush(&self) {
        self.state.service.flush().await;
    }

    /// Ends expired sessions at intervals, for ever.
    pub async fn sweep(&self) {
        let state = &self.state;
        let idle = state.config.session_idle;
        let often = (idle / 4).clamp(Duration::from_millis(100), Duration::from_secs(30));
        let mut ticks = interval(often);
        loop {
            ticks.tick().await;
            let expired = state.service.registry.sweep();
            state.service.prune();
            state.metrics.upkeep();
            if expired > 0 {
                let live = state.service.registry.len();
                tracing::info!(expired, live, "sessions expired");
            }
        }
    }
}
