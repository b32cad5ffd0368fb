//! What all handlers share.

use super::idempotency::IdempotencyStore;
use super::saturation::Saturation;
use crate::http::auth::access::Access;
use crate::http::config::service::Config;
use crate::http::config::store::SharedStore;
use crate::http::metrics::registry::Metrics;
use crate::http::quotas::clients::Clients;
use crate::http::stream::open_streams::OpenStreams;
use crate::sessions::{Admission, ByteBudget, Clock, Lease, Registry, Session};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;
use tokio::sync::Semaphore;

/// What all handlers share; clones are the same state.
#[derive(Debug, Clone)]
pub struct AppState(Arc<Shared>);

/// The fields of [`AppState`].
#[derive(Debug)]
pub struct Shared {
    /// The settings, validated.
    pub config: Config,
    /// The live sessions.
    pub registry: Registry,
    /// The store that replicas share.
    pub store: Option<SharedStore>,
    /// Which requests may work.
    pub admission: Admission,
    /// The memory of all uploads together.
    pub uploads: ByteBudget,
    /// What each client has in use.
    pub clients: Clients,
    /// Keys and secrets.
    pub access: Access,
    /// What is counted and measured.
    pub metrics: Metrics,
    /// The answers to requests with an idempotency key.
    pub opened: IdempotencyStore,
    /// The open streams.
    pub streams: OpenStreams,
    /// Places for the processes that decode videos.
    pub videos: Arc<Semaphore>,
    /// Whether `/readyz` has found the queue full.
    pub queue_saturation: Saturation,
    /// Whether `/readyz` has found the memory of uploads used up.
    pub upload_saturation: Saturation,
    clock: Clock,
    /// Set from the moment that the service was asked to end.
    draining: AtomicBool,
}

impl std::ops::Deref for AppState {
    type Target = Shared;
    fn deref(&self) -> &Shared {
        &self.0
    }
}

impl AppState {
    /// The state of a service with these settings, keys and this clock.
    ///
    /// # Errors
    /// The system gives no threads for the workers.
    pub fn new(
        config: Config,
        access: Access,
        clock: Clock,
        store: Option<SharedStore>,
    ) -> io::Result<Self> {
        let lease = Lease {
            first: config.session_first,
            idle: config.session_idle,
        };
        let (most, requests) = (config.max_sessions, config.session_queue);
        let registry = Registry::new(most, requests, lease, clock.clone());
        let registry = registry.with_memory(config.session_bytes());
        Ok(Self(Arc::new(Shared {
            registry: match store {
                Some(_) => registry.with_eviction(),
                None => registry,
            },
            store,
            admission: Admission::new(config.queue, config.worker_count())?,
            uploads: ByteBudget::new(config.max_upload_bytes),
            clients: Clients::new(&config),
            access,
            metrics: Metrics::new(),
            opened: IdempotencyStore::new(2 * (config.max_sessions + config.queue)),
            streams: OpenStreams::default(),
            // A client has one at a time, and no client all of them.
            videos: Arc::new(Semaphore::new(config.worker_count().max(2))),
            queue_saturation: Saturation::default(),
            upload_saturation: Saturation::default(),
            clock,
            draining: AtomicBool::new(false),
            config,
        })))
    }

    /// Makes `/readyz` answer 503 from now on.
    pub fn drain(&self) {
        self.draining.store(true, Ordering::Release);
    }

    /// Whether the service was asked to end.
    pub fn is_draining(&self) -> bool {
        self.draining.load(Ordering::Acquire)
    }

    /// The time.
    pub fn now(&self) -> SystemTime {
        self.clock.wall(self.clock.now())
    }

    /// Drops what is kept on behalf of sessions that have ended.
    pub fn prune(&self) {
        self.opened.prune(|id| self.registry.is_live(id));
    }

    /// When the session expires, in RFC 3339.
    pub fn expires_at(&self, session: &Session) -> String {
        let moment = self.registry.expires_at(session);
        humantime::format_rfc3339_seconds(moment).to_string()
    }
}
