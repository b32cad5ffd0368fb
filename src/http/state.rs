//! What all handlers share.
//!
//! In: the settings, the keys, the clock and the store. Out: an [`AppState`], whose clones share one state.

use crate::http::metrics::Metrics;
use axum::body::Bytes;
use bagtrack_access::Access;
use bagtrack_config::Config;
use bagtrack_quotas::{Client, Clients, VideoPlaces};
use bagtrack_sessions::clock::Instant;
use bagtrack_sessions::{
    Admission, Budget, Charge, Clock, Executor, Flow, IdempotencyStore, KEPT_ANSWERS, Lease,
    OpenStreams, Registry, ServiceParts, ServiceSettings, Session, SessionService, SessionStore,
};
use bagtrack_tracker::Expert;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;

/// What all handlers share. Clones share one state.
#[derive(Debug, Clone)]
pub struct AppState(Arc<Shared>);

/// The fields of [`AppState`].
#[derive(Debug)]
pub struct Shared {
    /// The settings, validated.
    pub config: Config,
    /// All acts on sessions go through this.
    pub service: SessionService,
    /// The memory budget of all uploads, and of answers that their clients have not taken, in bytes.
    pub uploads: Budget,
    /// The quotas of each client, and what it uses of them.
    pub clients: Clients,
    pub access: Access,
    pub metrics: Metrics,
    /// The last text of `/metrics`, and when its rendering began.
    pub rendered_metrics: tokio::sync::Mutex<Option<(Instant, Bytes)>>,
    /// Places for the processes that decode videos.
    pub videos: VideoPlaces,
    /// Whether `/readyz` has found the queue full.
    pub queue_saturation: Saturation,
    /// Whether `/readyz` has found the memory of uploads used up.
    pub upload_saturation: Saturation,
    clock: Clock,
}

impl std::ops::Deref for AppState {
    type Target = Shared;
    fn deref(&self) -> &Shared {
        &self.0
    }
}

/// The parts of a service, beside its settings.
#[derive(Debug)]
pub struct Parts {
    /// The clock by which sessions expire.
    pub clock: Clock,
    /// The store of the sessions; `None` keeps them in memory only. The store that the settings name is ignored.
    pub store: Option<Arc<dyn SessionStore>>,
    /// The expert that gives a second opinion in every session. The network that the settings name is ignored.
    pub expert: Option<Arc<dyn Expert>>,
    /// Runs the work on frames: decoding and tracking.
    pub executor: Executor,
}

impl AppState {
    /// The state of a service with these settings, keys and parts.
    pub fn new(config: Config, access: Access, parts: Parts) -> Self {
        let Parts {
            clock,
            store,
            expert,
            executor,
        } = parts;
        let metrics = Metrics::new();
        let clients = Clients::new(&config, store.is_some());
        let service = SessionService::new(ServiceParts {
            settings: settings(&config),
            registry: registry(&config, &clock, store.is_some()),
            store,
            admission: Admission::on(
                executor,
                config.queue,
                config.worker_count(),
                config.queue_delay,
            ),
            streams: OpenStreams::default(),
            opened: IdempotencyStore::new(2 * (config.max_sessions + config.queue)),
            keys: access.snapshots.clone(),
            expert,
            tracking: metrics.tracking.clone(),
            queue_wait: metrics.queue_wait.clone(),
            draining: AtomicBool::new(false),
        });
        Self(Arc::new(Shared {
            service,
            uploads: clients.all().upload_bytes.clone(),
            clients,
            access,
            metrics,
            rendered_metrics: tokio::sync::Mutex::default(),
            // There are at least two, and a client's account takes one at a time: no client has all.
            videos: VideoPlaces::new(config.video_places()),
            queue_saturation: Saturation::default(),
            upload_saturation: Saturation::default(),
            clock,
            config,
        }))
    }

    /// Whether the service was asked to end.
    pub fn is_draining(&self) -> bool {
        self.service.is_draining()
    }

    pub fn now(&self) -> SystemTime {
        self.clock.wall(self.clock.now())
    }

    /// A charge for the memory of a client's upload or answer; 0 bytes so far.
    pub fn charge(&self, client: &Client) -> Charge {
        Charge::new(&self.uploads, self.clients.account(client).bytes())
    }

    /// The flow in whose turns the client's work is done.
    pub fn flow(&self, client: &Client) -> Flow {
        self.clients.account(client).flow()
    }

    /// Sets the metrics that are read off when `/metrics` is rendered.
    pub fn measure(&self) {
        let (config, admission) = (&self.config, &self.service.admission);
        let workers = config.worker_count();
        let (sessions, busy) = (self.service.registry.len(), admission.busy_workers());
        let (held, is_draining) = (self.clients.all(), usize::from(self.is_draining()));
        for (name, description, value) in [
            ("bagtrack_sessions", "Sessions in memory.", sessions),
            (
                "bagtrack_sessions_max",
                "Most sessions there may be.",
                config.max_sessions,
            ),
            (
                "bagtrack_requests_inside",
                "Requests with a place in the queue.",
                admission.requests_inside(),
            ),
            (
                "bagtrack_workers_busy",
                "Workers at work.",
                busy.min(workers),
            ),
            ("bagtrack_workers", "Workers.", workers),
            (
                "bagtrack_upload_bytes",
                "Bytes of bodies that have come, and of answers that are not taken.",
                self.uploads.held(),
            ),
            (
                "bagtrack_videos",
                "Videos that are decoded.",
                self.videos.taken(),
            ),
            (
                "bagtrack_session_bytes",
                "Bytes that the states of sessions in memory may take.",
                held.session_bytes.held(),
            ),
            ("bagtrack_streams", "Open streams.", held.streams.held()),
            (
                "bagtrack_draining",
                "1 while the service is about to end.",
                is_draining,
            ),
        ] {
            self.metrics.set(name, description, value as f64);
        }
        if let Some(memory) = memory_stats::memory_stats() {
            let (name, bytes) = ("process_resident_memory_bytes", memory.physical_mem as f64);
            self.metrics
                .set(name, "Resident memory of the process.", bytes);
        }
        if let Some(store) = &self.service.store {
            let (name, is_up) = ("bagtrack_store_up", f64::from(u8::from(store.is_ready())));
            self.metrics
                .set(name, "1 while the store answers and takes writes.", is_up);
            let (name, is_full) = ("bagtrack_store_full", f64::from(u8::from(store.is_full())));
            let description = "1 after the store took no new session for want of room.";
            self.metrics.set(name, description, is_full);
            self.metrics.store_failures(store.failures());
        }
    }

    /// When the session expires, in RFC 3339.
    pub fn expires_at(&self, session: &Session) -> String {
        let moment = self.service.registry.expires_at(session);
        humantime::format_rfc3339_seconds(moment).to_string()
    }
}

fn settings(config: &Config) -> ServiceSettings {
    ServiceSettings {
        work_timeout: config.work_timeout,
        max_request_cpu: config.limits.max_request_cpu,
        frame: config.frame_limits(),
        max_request_pixels: config.limits.max_request_pixels,
        max_answers: config.max_frames.max(KEPT_ANSWERS),
        store_every: config.store.store_every,
    }
}

fn registry(config: &Config, clock: &Clock, has_store: bool) -> Registry {
    let lease = Lease {
        first: config.session_first,
        idle: config.session_idle,
    };
    let (most, requests) = (config.max_sessions, config.session_queue);
    let registry = Registry::new(most, requests, lease, clock.clone());
    let registry = registry.with_memory(config.session_bytes());
    match has_store {
        true => registry.with_eviction(),
        false => registry,
    }
}

/// Whether a number of places counts as full: from when at most a tenth of them is free until at least half of them is,
/// so that the answer does not flicker.
#[derive(Debug, Default)]
pub struct Saturation(AtomicBool);

impl Saturation {
    /// Notes that `free` of `all` places are free. Returns whether they count as full.
    pub fn update(&self, free: usize, all: usize) -> bool {
        let (fills, empties) = (free <= all / 10, free * 2 >= all);
        let before = self.0.load(Ordering::Relaxed);
        let now = if before { !empties } else { fills };
        self.0.store(now, Ordering::Relaxed);
        now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_queue_that_was_full_counts_as_full_until_half_of_it_is_free() {
        let saturation = Saturation::default();
        let free = [100, 11, 10, 11, 49, 50, 11, 0, 30];
        let found = free.map(|free| saturation.update(free, 100));
        let expected = [false, false, true, true, true, false, false, true, true];
        assert_eq!(found, expected);
        let single = Saturation::default();
        assert!(single.update(0, 1));
        assert!(!single.update(1, 1));
    }
}
