//! What the acts share: the parts of the service, its metrics, and the way to run work on its worker threads.

use super::error::ActError;
use super::idempotency::IdempotencyStore;
use crate::clock::{self, timeout};
use crate::streams::OpenStreams;
use crate::{
    Admission, Estimates, MacKeys, NoOutcome, QueuePermit, Registry, SessionStore, Stopped,
    WorkLimit, WorkMeter,
};
use bagtrack_tracker::{Expert, Status};
use metrics::{Counter, Histogram};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// All acts on sessions are methods of this service. Clones share its parts.
#[derive(Debug, Clone)]
pub struct SessionService(Arc<ServiceParts>);

/// The limits of a request's work, and of what is stored of a session.
#[derive(Debug, Clone)]
pub struct ServiceSettings {
    /// Most time that one request may take, waiting included.
    pub work_timeout: Duration,
    /// Most processor time that one request may take.
    pub max_request_cpu: Duration,
    /// The limits of each frame.
    pub frame: bagtrack_ingest::Limits,
    /// Most pixels of the frames of one request together.
    pub max_request_pixels: u64,
    /// Most stored answers of a session.
    pub max_answers: usize,
    /// The state is written to the store once every so many frames, at least 1.
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
    /// The sessions by the idempotency keys or ids under which they were opened.
    pub opened: IdempotencyStore,
    /// The keys that sign snapshots.
    pub keys: Arc<MacKeys>,
    /// The expert tracker whose opinion is asked in every session that is opened, where there is one.
    pub expert: Option<Arc<dyn Expert>>,
    /// The metrics of decoding and tracking.
    pub tracking: TrackingMetrics,
    /// Time in the queue.
    pub queue_wait: Histogram,
    /// Set when the service is asked to end.
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

    /// From now on no session is opened, and the state is written to the store after every request with frames.
    pub fn drain(&self) {
        self.draining.store(true, Ordering::Release);
    }

    /// Whether the service was asked to end.
    pub fn is_draining(&self) -> bool {
        self.draining.load(Ordering::Acquire)
    }

    /// Drops the names of sessions that have ended.
    pub fn prune(&self) {
        self.opened.prune(|id| self.registry.is_live(id));
    }

    /// Runs `work` on a worker, within the time that a request may take.
    ///
    /// At the deadline the caller gets its error at once. Work that has begun checks the deadline between frames, and
    /// whether its client has gone. It keeps its permits and the session's lock until it ends.
    ///
    /// # Errors
    /// Time is over, the work waited too long for a worker or panicked; or the error of `work` itself.
    pub async fn run<T, E, F>(&self, queue: QueuePermit, work: F) -> Result<T, E>
    where
        T: Send + 'static,
        E: From<ActError> + Send + 'static,
        F: FnOnce(&mut WorkMeter) -> Result<T, E> + Send + 'static,
    {
        let deadline = clock::now() + self.settings.work_timeout;
        let max_cpu = self.settings.max_request_cpu;
        let max_cpu = max_cpu.saturating_mul(queue.cpu_share());
        let limit = WorkLimit::new(deadline, max_cpu, queue.spent().clone());
        let _client = limit.abandon_on_drop();
        let (asked, waited) = (clock::now(), self.queue_wait.clone());
        let work = self.admission.run(queue, move |turn| {
            waited.record(asked.elapsed().as_secs_f64());
            work(&mut limit.start(turn))
        });
        let error: ActError = match timeout(self.settings.work_timeout, work).await {
            Ok(Ok(done)) => return done,
            Ok(Err(NoOutcome::Overload)) => Stopped::Overload.into(),
            Ok(Err(NoOutcome::Panicked(panicked))) => panicked.into(),
            Err(_) => Stopped::Deadline.into(),
        };
        Err(error.into())
    }
}

/// The metrics of decoding and tracking. Clones share them.
#[derive(Debug, Clone)]
pub struct TrackingMetrics {
    /// Seconds to decode a frame.
    pub decode: Histogram,
    /// Seconds of processor time to track a target through a frame.
    pub step: Histogram,
    /// Answers with the status `Tracking`, one for each target and frame.
    pub tracking: Counter,
    /// Answers with the status `Uncertain`.
    pub uncertain: Counter,
    /// Answers with the status `Lost`.
    pub lost: Counter,
    /// How often a target's status became `Lost`.
    pub losses: Counter,
}

impl TrackingMetrics {
    /// Metrics that nobody collects.
    pub fn noop() -> Self {
        Self {
            decode: Histogram::noop(),
            step: Histogram::noop(),
            tracking: Counter::noop(),
            uncertain: Counter::noop(),
            lost: Counter::noop(),
            losses: Counter::noop(),
        }
    }

    /// Runs `work`, which decodes a frame, and measures its time.
    pub fn decoding<T>(&self, work: impl FnOnce() -> T) -> T {
        let started = clock::now();
        let result = work();
        self.decode.record(started.elapsed().as_secs_f64());
        result
    }

    /// Counts tracked frames. `before` is the answer to the frame before them, `answers` are theirs, `steps` is the
    /// processor time of each step of a tracker.
    pub fn tracked(&self, before: &Estimates, answers: &[Estimates], steps: &[Duration]) {
        for step in steps {
            self.step.record(step.as_secs_f64());
        }
        let mut last = before;
        for answer in answers {
            for (estimate, before) in answer.as_slice().iter().zip(last.as_slice()) {
                let counter = match estimate.status {
                    Status::Tracking => &self.tracking,
                    Status::Uncertain => &self.uncertain,
                    Status::Lost => &self.lost,
                };
                counter.increment(1);
                if estimate.status == Status::Lost && before.status != Status::Lost {
                    self.losses.increment(1);
                }
            }
            last = answer;
        }
    }
}
