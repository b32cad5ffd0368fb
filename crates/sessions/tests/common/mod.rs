//! What the tests of acts and those of stores share: a service and its requests.

use bagtrack_sessions::{
    Admission, CreationKey, Flow, IdempotencyStore, MacKeys, OpenError, OpenRequest, OpenStreams,
    Owner, QueuePermit, QuotaExhausted, Registry, Reservation, ServiceParts, ServiceSettings,
    SessionQuota, SessionService, Start, StoreShare, TrackingMetrics,
};
use bagtrack_tracker::{Params, Preset, Rect};
use metrics::Histogram;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Asserts that a value is of this pattern.
macro_rules! assert_matches {
    ($value:expr, $($pattern:tt)+) => {{
        let value = &$value;
        assert!(matches!(value, $($pattern)+), "{value:?}");
    }};
}
pub(crate) use assert_matches;

pub const FLOW: Flow = Flow(0);
/// The target in the first picture.
pub const FIRST: Rect = Rect {
    x: 20.0,
    y: 15.0,
    width: 16.0,
    height: 12.0,
};

/// Parameters with which a frame takes little time.
pub fn params() -> Params {
    let mut params = Preset::Paper.params();
    params.particles = 20;
    params
}

/// The parts of a service without a store, where a request may take `limit`.
pub fn parts(registry: Registry, admission: Admission, limit: Duration) -> ServiceParts {
    ServiceParts {
        settings: ServiceSettings {
            work_timeout: limit,
            max_request_cpu: limit,
            frame: bagtrack_ingest::Limits::default(),
            max_request_pixels: u64::MAX,
            max_answers: 64,
            store_every: 1,
        },
        registry,
        store: None,
        admission,
        streams: OpenStreams::default(),
        opened: IdempotencyStore::new(64),
        keys: Arc::new(keys()),
        expert: None,
        tracking: TrackingMetrics::noop(),
        queue_wait: Histogram::noop(),
        draining: AtomicBool::new(false),
    }
}

pub fn keys() -> MacKeys {
    MacKeys::new("bagtrack tests of stores", &["secret"])
}

pub fn place(service: &SessionService) -> QueuePermit {
    service.admission.enter(FLOW, Box::new(())).unwrap()
}

/// A client's quota.
#[derive(Debug)]
pub struct Quota {
    /// Whether it may open one more session.
    pub is_free: bool,
    /// How many targets its sessions may have together.
    pub targets: usize,
}

/// The quota of a client that may have as much as it likes.
pub const FREE: Quota = Quota {
    is_free: true,
    targets: usize::MAX,
};

impl SessionQuota for Quota {
    fn check(&self) -> Result<(), OpenError> {
        match self.is_free {
            true => Ok(()),
            false => Err(exhausted("sessions", 0)),
        }
    }

    fn reserve(&self, targets: usize, _bytes: usize) -> Result<Reservation, OpenError> {
        match targets <= self.targets {
            true => Ok(Box::new(())),
            false => Err(exhausted("targets", self.targets)),
        }
    }

    fn store_share(&self) -> StoreShare {
        StoreShare {
            client: "a client".to_owned(),
            max_places: usize::MAX,
            max_bytes: usize::MAX,
        }
    }
}

fn exhausted(what: &'static str, limit: usize) -> OpenError {
    QuotaExhausted { what, limit }.into()
}

/// A request for a session, whose digest is 32 times the byte `digest`.
pub fn request(
    service: &SessionService,
    key: Option<CreationKey>,
    digest: u8,
    start: Start,
) -> OpenRequest {
    OpenRequest {
        key,
        owner: Owner::default(),
        digest: [digest; 32],
        start,
        quota: Arc::new(FREE),
        queue: place(service),
    }
}
