//! A request's place in the queue, and what it is to the workers.

use super::fair_queue::Asked;
use super::flows::{Flow, Job};
use super::places::Place;
use super::work_limit::CpuSpent;
use std::any::Any;
use std::sync::Arc;
use std::time::Duration;

/// Least processor time of decoding a picture, for each of its pixels and for each byte of its file. Most pictures take
/// a few times as much: those that are surely slow are known before they begin.
const NANOS_PER_PIXEL: u64 = 4;
const NANOS_PER_BYTE: u64 = 8;

/// What a request holds until its work has ended: its share of memory, its place in a quota.
pub type Reservation = Box<dyn Any + Send + Sync>;

/// A place in the queue, given back when the last clone is dropped.
#[derive(Debug, Clone)]
pub struct QueuePermit {
    // The place is free before what is held.
    _place: Arc<Place>,
    request: Ticket,
}

/// A request without a place in the queue: it has not come there, or waits for something else than a worker.
#[derive(Debug, Clone)]
pub struct Ticket {
    flow: Flow,
    length: Job,
    expected: Duration,
    may_refuse: bool,
    cpu_share: u32,
    spent: CpuSpent,
    _held: Arc<Reservation>,
}

impl Ticket {
    /// A client's request, which holds `held` until its work has ended.
    pub(super) fn new(flow: Flow, held: Reservation) -> Self {
        Self {
            flow,
            length: Job::Single,
            expected: Duration::ZERO,
            may_refuse: true,
            cpu_share: 1,
            spent: CpuSpent::default(),
            _held: Arc::new(held),
        }
    }

    /// Whose turn the request's work is done in.
    pub(super) fn flow(&self) -> Flow {
        self.flow
    }
}

impl QueuePermit {
    /// The place of this request.
    pub(super) fn new(request: Ticket, place: Place) -> Self {
        Self {
            _place: Arc::new(place),
            request,
        }
    }

    /// What the request asks of the workers. Work on several frames may wait: others go between.
    pub(super) fn asked(&self) -> Asked {
        let request = &self.request;
        Asked {
            flow: request.flow,
            length: request.length,
            expected: request.expected,
            may_refuse: request.may_refuse && request.length == Job::Single,
        }
    }

    /// For work that cannot grow while it waits, as that of a client which sends no more before it has an answer, or of
    /// a request with several frames: it waits for a worker, however long that takes.
    pub fn waiting(mut self) -> Self {
        self.request.may_refuse = false;
        self
    }

    /// For work on frames of at most so many pixels, whose files have at most so many bytes.
    pub fn for_size(mut self, pixels: u64, bytes: usize) -> Self {
        let nanos = pixels.saturating_mul(NANOS_PER_PIXEL);
        let nanos = nanos.max((bytes as u64).saturating_mul(NANOS_PER_BYTE));
        self.request.expected = Duration::from_nanos(nanos);
        self
    }

    /// For work that surely takes so much processor time without a break.
    pub fn for_time(mut self, least: Duration) -> Self {
        self.request.expected = least;
        self
    }

    /// Whose turn the request's work is done in.
    pub fn flow(&self) -> Flow {
        self.request.flow
    }

    /// For work on so many frames, which gives way to shorter work between two of them.
    pub fn for_frames(mut self, count: usize) -> Self {
        self.request.length = match count {
            0 | 1 => Job::Single,
            _ => Job::Batch,
        };
        self
    }

    /// The request may take the processor time of so many requests.
    pub fn with_cpu_of(mut self, requests: u32) -> Self {
        self.request.cpu_share = requests;
        self
    }

    /// Of how many requests it may take the processor time.
    pub fn cpu_share(&self) -> u32 {
        self.request.cpu_share
    }

    /// Processor time that the request has taken.
    pub fn spent(&self) -> &CpuSpent {
        &self.request.spent
    }

    /// Gives the place back, as far as no work of the request has it, and keeps what the request holds.
    pub fn yield_place(self) -> Ticket {
        self.request
    }
}
