//! What the acts share.

use super::idempotency::IdempotencyStore;
use super::tracking_metrics::TrackingMetrics;
use crate::streams::OpenStreams;
use crate::{Admission, MacKeys, Registry, SessionStore};
use bagtrack_tracker::Expert;
use metrics::Histogram;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The one door to sessions. Clones are the same service.
#[derive(Debug, Clone)]
pub struct SessionService(Arc<ServiceParts>);

/// What a request may take, and how sessions are kept.
#[derive(Debug, Clone)]
pub struct ServiceSettings {
    /// Time for one request's work, the waiting included.
    pub work_timeout: Duration,
    /// Processor time of one request.
    pub max_request_cpu: Duration,
    /// The limits of each frame.
    pub frame: bagtrack_ingest::Limits,
    /// Most pixels of the frames of one request together.
    pub max_request_pixels: u64,
    /// Most stored answers of a session.
    pub max_answers: usize,
    /// The state is written to the store at every so many frames.
    pub store_every: u64,
}

/// The fields of [`SessionService`].
#[derive(Debug)]
pub struct ServiceParts {
    /// The settings.
    pub settings: ServiceSettings,
    /// The sessions in memory.
    pub registry: Registry,
    /// The store that replicas share, where there is one.
    pub store: Option<Arc<dyn SessionStore>>,
    /// The queue and the workers.
    pub admission: Admission,
    /// The open streams.
    pub streams: OpenStreams,
    /// The sessions by the names under which they were opened.
    pub opened: IdempotencyStore,
    /// The keys that sign snapshots.
    pub keys: Arc<MacKeys>,
    /// What gives a second opinion in every session that is opened, where there is one.
    pub expert: Option<Arc<dyn Expert>>,
    /// What decoding and tracking measure.
    pub tracking: TrackingMetrics,
    /// Time in the queue.
    pub queue_wait: Histogram,
    /// Set from the moment that the service was asked to end.
    pub draining: AtomicBool,
}

impl std::ops::Deref for SessionService {
    type Target = ServiceParts;
    fn deref(&self) -> &ServiceParts {
        &self.0
    }
}

impl SessionService {
    /// A service of these parts.
    pub fn new(parts: ServiceParts) -> Self {
        Self(Arc::new(parts))
    }

    /// From now on no session is opened, and every frame's state is written to the store.
    pub fn drain(&self) {
        self.draining.store(true, Ordering::Release);
    }

    /// Whether the service was asked to end.
    pub fn is_draining(&self) -> bool {
        self.draining.load(Ordering::Acquire)
    }

    /// Drops what is kept on behalf of sessions that have ended.
    pub fn prune(&self) {
        self.opened.prune(|id| self.registry.is_live(id));
    }
}
