//! What a connection goes through from when it is accepted to its end.

#[cfg(feature = "tls")]
use crate::http::server::router::https_only;
use crate::http::server::router::probes_only;
use crate::http::state::AppState;
use axum::Router;
use axum::body::Body;
use bagtrack_config::MAX_BUFFER_BYTES;
use bagtrack_net::{
    Begun, ClientLimits, ConnectionHold, ConnectionIo, Peer, Security, Transport, is_trusted,
};
use bagtrack_quotas::Client;
use bagtrack_sessions::clock::timeout;
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::task::yield_now;

/// How long a connection that is for probes alone may take to begin: others wait for its place.
const PROBE_TIMEOUT: Duration = Duration::from_secs(5);

/// How all connections of a service are served.
#[derive(Debug)]
pub struct ConnectionService {
    state: AppState,
    security: Security,
    routes: Router,
    /// For clients that speak plain HTTP where TLS is expected.
    #[cfg(feature = "tls")]
    https_only: Router,
    http: http1::Builder,
    handshake_timeout: Duration,
}

impl ConnectionService {
    /// Of a service with these routes.
    pub fn new(state: AppState, security: Security, routes: Router) -> Self {
        let begins_within = state.config.header_timeout;
        Self::beginning_within(begins_within, state, security, routes)
    }

    /// For connections over the share of their address.
    pub fn for_probes(state: AppState, security: Security) -> Self {
        let begins_within = state.config.header_timeout.min(PROBE_TIMEOUT);
        let routes = probes_only(&state);
        Self::beginning_within(begins_within, state, security, routes)
    }

    fn beginning_within(
        handshake_timeout: Duration,
        state: AppState,
        security: Security,
        routes: Router,
    ) -> Self {
        let mut http = http1::Builder::new();
        http.timer(TokioTimer::new())
            .max_buf_size(MAX_BUFFER_BYTES)
            .header_read_timeout(handshake_timeout);
        Self {
            #[cfg(feature = "tls")]
            https_only: https_only(&state),
            state,
            security,
            routes,
            http,
            handshake_timeout,
        }
    }

    /// Whether connections begin with a TLS handshake.
    pub fn has_tls(&self) -> bool {
        self.security.has_tls()
    }

    /// Serves one connection until it ends, or a stream has taken it over.
    pub async fn serve(&self, stream: TcpStream, peer: SocketAddr, mut hold: ConnectionHold) {
        if let Err(error) = stream.set_nodelay(true) {
            tracing::debug!(%error, "cannot set TCP_NODELAY");
        }
        let beginning = async {
            if self.has_tls() {
                self.handshake_turn(peer).await;
            }
            self.security.begin(stream).await
        };
        let beginning = timeout(self.handshake_timeout, beginning);
        let (transport, routes) = match hold.begin(beginning).await {
            Some(Ok(Ok(Begun::AsConfigured(transport)))) => (transport, &self.routes),
            #[cfg(feature = "tls")]
            Some(Ok(Ok(Begun::WithoutTls(transport)))) => (transport, &self.https_only),
            Some(Ok(Err(error))) => return tracing::debug!(%peer, %error, "no TLS handshake"),
            Some(Err(_)) => return tracing::debug!(%peer, "the TLS handshake took too long"),
            None => return tracing::debug!(%peer, "connection closed during its TLS handshake"),
        };
        self.speak_http(transport, peer, routes.clone(), hold).await;
    }

    /// Waits until the client at this address may make a handshake. A trusted proxy makes those of many.
    async fn handshake_turn(&self, peer: SocketAddr) {
        let trusted = &self.state.config.limits.trusted_proxies;
        if !is_trusted(peer.ip().to_canonical(), trusted) {
            let account = self.state.clients.account(&Client::at(peer.ip()));
            account.handshake_in_order().await;
        }
    }

    /// Serves HTTP over these bytes until they end, or a stream that has taken them over does.
    pub async fn serve_http(&self, transport: Transport, peer: SocketAddr, hold: ConnectionHold) {
        let routes = self.routes.clone();
        self.speak_http(transport, peer, routes, hold).await;
    }

    async fn speak_http(
        &self,
        transport: Transport,
        peer: SocketAddr,
        routes: Router,
        hold: ConnectionHold,
    ) {
        let activity = hold.activity().clone();
        let limits = &self.state.config.limits;
        let limits = ClientLimits {
            write_timeout: limits.write_timeout,
            min_answer_rate: limits.min_answer_rate,
            half_close_timeout: limits.half_close_timeout,
        };
        let io = ConnectionIo::new(transport, activity.clone(), limits);
        let service = TowerToHyperService::new(routes);
        let connection = hold.clone();
        let watched = service_fn(move |request: Request<Incoming>| {
            let activity = activity.clone();
            let mut request = request.map(|body| activity.receive(Body::new(body)));
            request.extensions_mut().insert(Peer(peer));
            request.extensions_mut().insert(connection.clone());
            let answer = service.call(request);
            async move {
                // hyper goes on with the next of the requests that came at once, up to 16 of them.
                yield_now().await;
                answer.await.map(|answer| activity.answer(answer))
            }
        });
        let connection = self.http.serve_connection(TokioIo::new(io), watched);
        hold.serve(connection.with_upgrades()).await;
    }
}
