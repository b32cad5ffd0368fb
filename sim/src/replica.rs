//! A replica: the real service with its tasks, which run until the replica is killed.

use crate::chance::Chance;
use crate::faults::Rates;
use crate::life::{Life, MortalStream};
use crate::redis::line::Line;
use crate::redis::server::Server;
use crate::trace::Trace;
use axum::Router;
use axum::body::Body;
use bagtrack::http::{Config, ConnectionService, Parts, Service};
use bagtrack_net::{ConnectionHold, Connections};
use bagtrack_sessions::clock::{Instant, now, sleep, timeout};
use bagtrack_sessions::{Clock, Executor, RedisAddress, RedisStore, SessionStore};
use bytes::Bytes;
use http::{Request, Response};
use http_body_util::BodyExt;
use metrics::Counter;
use std::cell::Cell;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::{Duration, SystemTime};
use tokio::io::DuplexStream;
use tokio::sync::{oneshot, watch};
use tower::ServiceExt;

/// How long a session lives without a frame.
pub const IDLE: Duration = Duration::from_secs(40);
/// Longest time for open connections to end when a replica is drained.
const SHUTDOWN: Duration = Duration::from_secs(2);
/// The address of all callers.
const CLIENT: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 1);
/// Longest time of a call to the store.
const STORE_TIMEOUT: Duration = Duration::from_millis(800);

/// What all replicas of a run have in common.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The store; without one, each replica keeps its sessions to itself.
    pub store: Option<Server>,
    /// The state is written to the store once every so many frames.
    pub store_every: u64,
    pub workers: usize,
    pub rates: Rates,
    pub chance: Chance,
    pub trace: Trace,
}

/// A replica.
#[derive(Debug, Clone)]
pub struct Replica {
    /// "replica 1.3": the third start of the replica in place 1.
    pub name: String,
    pub life: Life,
    pub service: Service,
    /// The clock by which its sessions expire.
    pub clock: Clock,
    router: Router,
    connections: Arc<Lines>,
}

/// The connections to a replica, for streams.
#[derive(Debug)]
struct Lines {
    service: ConnectionService,
    open: Arc<Connections>,
    /// Set to true when the connections are to end.
    ending: watch::Sender<bool>,
    /// Dropping this sender would cut the connections off: it lives as long as the replica.
    keep_alive: watch::Sender<()>,
}

thread_local! {
    static BEGIN: Cell<Option<Instant>> = const { Cell::new(None) };
}

/// Begins the simulated time of day of this thread's run, which is the same in all runs.
pub fn set_time_of_day() {
    BEGIN.set(Some(now()));
}

fn time_of_day() -> SystemTime {
    let passed = BEGIN.get().map(|begin| begin.elapsed());
    SystemTime::UNIX_EPOCH + Duration::from_secs(1_800_000_000) + passed.unwrap_or_default()
}

fn config(setup: &Setup) -> Config {
    let mut config = Config {
        workers: Some(setup.workers),
        queue: 16,
        max_sessions: 8,
        session_idle: IDLE,
        session_first: IDLE,
        work_timeout: Duration::from_secs(5),
        ..Config::default()
    };
    config.limits.client_sessions = Some(8);
    config.limits.client_requests = Some(16);
    config.store.store_every = setup.store_every;
    config.access.snapshot_keys = vec!["a secret of all replicas".into()];
    config
}

impl Replica {
    pub async fn start(setup: &Setup, name: String) -> Self {
        let (life, clock) = (Life::default(), Clock::with_wall(time_of_day));
        let store = match &setup.store {
            None => None,
            Some(server) => Some(store(setup, &name, server, &life, &clock).await),
        };
        let parts = Parts {
            clock: clock.clone(),
            store,
            expert: None,
            executor: executor(setup, &life),
        };
        let service = Service::new(config(setup), parts).expect("the settings are valid");
        tokio::spawn(life.run({
            let service = service.clone();
            async move { service.sweep().await }
        }));
        let router = service.router(CLIENT);
        let connections = Lines {
            service: service.connections(),
            open: Connections::new(1000, 1000, Counter::noop()),
            ending: watch::Sender::new(false),
            keep_alive: watch::Sender::new(()),
        };
        setup.trace.note(format_args!("{name} started"));
        Self {
            name,
            life,
            service,
            clock,
            router,
            connections: Arc::new(connections),
        }
    }

    /// Serves a connection until its client or the replica ends it.
    pub fn connect(&self, line: DuplexStream) {
        let connections = self.connections.clone();
        let permit = connections.open.enter(CLIENT.ip(), true);
        let permit = permit.expect("there are few of them");
        let (ending, cut_off) = (&connections.ending, &connections.keep_alive);
        let hold = ConnectionHold::new(permit, ending.subscribe(), cut_off.subscribe());
        let line = Box::new(MortalStream::new(self.life.clone(), line));
        let serving = async move { connections.service.serve_http(line, CLIENT, hold).await };
        tokio::spawn(self.life.run(serving));
    }

    /// Asks connections to end, and waits some time until they have.
    pub async fn end_connections(&self) {
        self.connections.ending.send_replace(true);
        let _ = timeout(SHUTDOWN, self.connections.ending.closed()).await;
    }

    /// The answer to a request, with its whole body; none if the replica dies first. Dropping the returned
    /// [`AbortOnDrop`] aborts the request; dropping the receiver does not.
    pub fn answer(
        &self,
        request: Request<Body>,
    ) -> (oneshot::Receiver<Response<Bytes>>, AbortOnDrop) {
        let (send, answer) = oneshot::channel();
        let router = self.router.clone();
        let task = tokio::spawn(self.life.run(async move {
            let Ok(response) = router.oneshot(request).await;
            let (head, body) = response.into_parts();
            if let Ok(body) = body.collect().await {
                let _ = send.send(Response::from_parts(head, body.to_bytes()));
            }
        }));
        (answer, AbortOnDrop(Some(task.abort_handle())))
    }
}

/// Aborts a request when its client has gone, unless detached.
#[derive(Debug)]
pub struct AbortOnDrop(Option<tokio::task::AbortHandle>);

impl AbortOnDrop {
    /// The request goes on without its client, as behind a proxy that does not report that the client has gone.
    pub fn detach(mut self) {
        self.0 = None;
    }
}

impl Drop for AbortOnDrop {
    fn drop(&mut self) {
        if let Some(task) = &self.0 {
            task.abort();
        }
    }
}

async fn store(
    setup: &Setup,
    name: &str,
    server: &Server,
    life: &Life,
    clock: &Clock,
) -> Arc<dyn SessionStore> {
    let line = Line {
        name: name.to_owned(),
        server: server.clone(),
        life: life.clone(),
        rates: setup.rates.clone(),
        chance: setup.chance.clone(),
        trace: setup.trace.clone(),
    };
    let address = RedisAddress::of(Arc::new(line));
    let store = RedisStore::connect(address, "sim", STORE_TIMEOUT, clock.clone()).await;
    Arc::new(store.expect("the address can be used"))
}

/// Does a replica's work on the thread of the simulation, after a simulated time that stands for the work's.
fn executor(setup: &Setup, life: &Life) -> Executor {
    let (chance, life) = (setup.chance.clone(), life.clone());
    Executor::on_one_thread(move |work| {
        let takes = chance.millis(1..20);
        tokio::spawn(life.run(async move {
            sleep(takes).await;
            work()();
        }));
    })
}
