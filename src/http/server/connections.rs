//! Connections: accepted or refused, and what each goes through to its end.
//!
//! `axum::serve` has no time limit for request heads: a client that sends half a line holds its connection for ever.
//! hyper's connection builder has such a limit. Connections are [counted](Connections), too.

use crate::http::metrics::Metrics;
use crate::http::middleware::response_headers::{HEADERS, STRICT};
use crate::http::problems::problem::Problem;
use crate::http::respond::body::json_line;
#[cfg(feature = "tls")]
use crate::http::server::router::https_only;
use crate::http::server::router::probes_only;
use crate::http::state::AppState;
use axum::Router;
use axum::body::Body;
use axum::http::header::CONTENT_SECURITY_POLICY;
use bagtrack_api::media_types::PROBLEM;
use bagtrack_config::{MAX_BUFFER_BYTES, PROBE_CONNECTIONS};
use bagtrack_net::{
    Begun, ClientLimits, ConnectionHold, ConnectionIo, Connections, NoRoom, Peer, Security,
    Transport, is_trusted,
};
use bagtrack_quotas::Client;
use bagtrack_sessions::clock::{sleep, timeout};
use bagtrack_sessions::random::new_id;
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::io::Write;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;
use tokio::task::yield_now;

/// How long to wait after the system could not accept a connection.
const RETRY: Duration = Duration::from_millis(100);
/// Most connections of one address that serve nothing but probes.
const PROBE_CONNECTIONS_OF_ADDRESS: usize = 8;

/// Accepts connections for ever. The first service serves those within the share of their address, the second one those
/// over it. Connections end when `cut_off` loses its sender.
pub(super) async fn accept(
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

/// Tells a client that it has too many connections, and closes this one. The answer is written without waiting, so a
/// part may be lost. With TLS nothing is written: plain text before the handshake looks like a fault of the service.
fn refuse(stream: TcpStream, peer: SocketAddr, state: &AppState, has_tls: bool) {
    let problem = Problem::too_many_connections();
    let answer = refusal(&problem, peer.ip(), &state.metrics);
    if let Ok(mut stream) = stream.into_std()
        && !has_tls
    {
        // The write does not wait: a stream of tokio is not in blocking mode.
        let _ = stream.write(&answer);
    }
}

/// The HTTP answer with a problem that ends a connection before any request is read. Counts the problem, and logs it.
fn refusal(problem: &Problem, client: IpAddr, metrics: &Metrics) -> Vec<u8> {
    let id = new_id().to_string();
    metrics.problem(problem.kind());
    let (kind, status) = (problem.kind().slug(), problem.kind().status());
    tracing::info!(id, %client, kind, status, "connection refused");
    let document = problem.document("", "/".to_owned(), id.clone());
    let body = json_line(&document).unwrap_or_default();
    let retry = problem.retry_seconds();
    let retry = retry.map_or(String::new(), |seconds| {
        format!("retry-after: {seconds}\r\n")
    });
    let security = [(CONTENT_SECURITY_POLICY, STRICT)]
        .into_iter()
        .chain(HEADERS);
    let security: String = security
        .map(|(name, value)| format!("{name}: {value}\r\n"))
        .collect();
    let head = format!(
        "HTTP/1.1 {}\r\ncontent-type: {PROBLEM}\r\ncontent-length: {}\r\n{retry}x-request-id: {id}\r\n\
         cache-control: no-store\r\n{security}connection: close\r\n\r\n",
        problem.status(),
        body.len()
    );
    [head.into_bytes(), body].concat()
}

/// Most time for a TLS handshake or the head of a request on a connection for probes: others wait for its place.
const PROBE_TIMEOUT: Duration = Duration::from_secs(5);

/// How all connections of a service are served.
#[derive(Debug)]
pub struct ConnectionService {
    state: AppState,
    security: Security,
    routes: Router,
    /// The routes for clients that speak plain HTTP where TLS is expected.
    #[cfg(feature = "tls")]
    https_only: Router,
    http: http1::Builder,
    handshake_timeout: Duration,
}

impl ConnectionService {
    /// Serves connections with these routes.
    pub fn new(state: AppState, security: Security, routes: Router) -> Self {
        let begins_within = state.config.header_timeout;
        Self::beginning_within(begins_within, state, security, routes)
    }

    /// Serves nothing but probes, to connections over the share of their address.
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

    /// Waits until the client at this address may make a TLS handshake. A trusted proxy does not wait: it makes the
    /// handshakes of many clients.
    async fn handshake_turn(&self, peer: SocketAddr) {
        let trusted = &self.state.config.limits.trusted_proxies;
        if !is_trusted(peer.ip().to_canonical(), trusted) {
            let account = self.state.clients.account(&Client::at(peer.ip()));
            account.handshake_in_order().await;
        }
    }

    /// Serves HTTP over this transport until the connection ends, or a stream has taken it over.
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
                // hyper would answer up to 16 pipelined requests without a break for other tasks.
                yield_now().await;
                answer.await.map(|answer| activity.answer(answer))
            }
        });
        let connection = self.http.serve_connection(TokioIo::new(io), watched);
        hold.serve(connection.with_upgrades()).await;
    }
}
