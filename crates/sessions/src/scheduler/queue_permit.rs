//! A request's place in the queue, and what it asks of the workers.
//!
//! A client that has no place always gets one, however many the others have taken: there are as many places again for
//! that. So some clients with all the requests that they may have in flight do not close the service to the others.

use super::fair_queue::Asked;
use super::flows::{Flow, Job};
use super::work_limit::CpuSpent;
use crate::sync::{Mutex, lock};
use std::any::Any;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// The places in the queue, and how many of them each client has.
#[derive(Debug)]
pub(super) struct Places {
    queue: Arc<Semaphore>,
    /// Spare places, for clients that have none.
    spare: Arc<Semaphore>,
    taken: Mutex<HashMap<Flow, usize>>,
}

/// A client's place, given back when this is dropped.
#[derive(Debug)]
pub(super) struct Place {
    places: Arc<Places>,
    flow: Flow,
    _permit: OwnedSemaphorePermit,
}

impl Places {
    /// `count` places, and as many spare ones for clients that have none.
    pub(super) fn new(count: usize) -> Arc<Self> {
        Arc::new(Self {
            queue: Arc::new(Semaphore::new(count)),
            spare: Arc::new(Semaphore::new(count)),
            taken: Mutex::default(),
        })
    }

    /// Takes a place, where there is one for this client.
    pub(super) fn take(self: &Arc<Self>, flow: Flow) -> Option<Place> {
        let mut taken = lock(&self.taken);
        let permit = self.queue.clone().try_acquire_owned().ok();
        let permit = match taken.contains_key(&flow) {
            true => permit?,
            false => permit.or_else(|| self.spare.clone().try_acquire_owned().ok())?,
        };
        Some(self.place(&mut taken, flow, permit))
    }

    /// Takes a place for this client, and waits for it in order of arrival.
    pub(super) async fn take_in_order(self: &Arc<Self>, flow: Flow) -> Place {
        if let Some(place) = self.take(flow) {
            return place;
        }
        let permit = self.queue.clone().acquire_owned().await;
        let permit = permit.expect("the queue is never closed");
        self.place(&mut lock(&self.taken), flow, permit)
    }

    /// Whether there is a place for this client now.
    pub(super) fn has_place(&self, flow: Flow) -> bool {
        let is_new = !lock(&self.taken).contains_key(&flow);
        self.free() > 0 || is_new && self.spare.available_permits() > 0
    }

    /// Places that any client may take.
    pub(super) fn free(&self) -> usize {
        self.queue.available_permits()
    }

    pub(super) fn len(&self) -> usize {
        lock(&self.taken).values().sum()
    }

    fn place(
        self: &Arc<Self>,
        taken: &mut HashMap<Flow, usize>,
        flow: Flow,
        permit: OwnedSemaphorePermit,
    ) -> Place {
        *taken.entry(flow).or_default() += 1;
        Place {
            places: self.clone(),
            flow,
            _permit: permit,
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut taken = lock(&self.places.taken);
        if let Some(count) = taken.get_mut(&self.flow) {
            *count -= 1;
            if *count == 0 {
                taken.remove(&self.flow);
            }
        }
    }
}

/// Least processor time of decoding a picture, for each of its pixels and for each byte of its file. Most pictures take
/// a few times as much. The bound tells before the work begins which pictures are surely slow.
const NANOS_PER_PIXEL: u64 = 4;
const NANOS_PER_BYTE: u64 = 8;

/// What a request holds until its work has ended: its share of memory, its place in a quota.
pub type Reservation = Box<dyn Any + Send + Sync>;

/// A place in the queue, given back when the last clone is dropped.
#[derive(Debug, Clone)]
pub struct QueuePermit {
    // Fields are dropped in order: the place is free before what the request holds.
    _place: Arc<Place>,
    request: Ticket,
}

/// A request without a place in the queue: it has not entered yet, or has left to wait for something else than a
/// worker.
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

    /// The client's flow, in whose turns the work is done.
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

    /// What the request asks of the workers. Work on several frames is never refused for its wait.
    pub(super) fn asked(&self) -> Asked {
        let request = &self.request;
        Asked {
            flow: request.flow,
            length: request.length,
            expected: request.expected,
            may_refuse: request.may_refuse && request.length == Job::Single,
        }
    }

    /// Lets the request wait for a worker however long that takes. For clients that send nothing more before they have
    /// an answer, and for requests with several frames: their queues do not grow while they wait.
    pub fn waiting(mut self) -> Self {
        self.request.may_refuse = false;
        self
    }

    /// For work on frames of at most `pixels` pixels, whose files have at most `bytes` bytes.
    pub fn for_size(mut self, pixels: u64, bytes: usize) -> Self {
        let nanos = pixels.saturating_mul(NANOS_PER_PIXEL);
        let nanos = nanos.max((bytes as u64).saturating_mul(NANOS_PER_BYTE));
        self.request.expected = Duration::from_nanos(nanos);
        self
    }

    /// For work that takes at least this much processor time without a break.
    pub fn for_time(mut self, least: Duration) -> Self {
        self.request.expected = least;
        self
    }

    /// The client's flow, in whose turns the work is done.
    pub fn flow(&self) -> Flow {
        self.request.flow
    }

    /// For work on `count` frames. Work on several gives way to other clients' work between two of them.
    pub fn for_frames(mut self, count: usize) -> Self {
        self.request.length = match count {
            0 | 1 => Job::Single,
            _ => Job::Batch,
        };
        self
    }

    /// Lets the request take the processor time that `requests` requests may take.
    pub fn with_cpu_of(mut self, requests: u32) -> Self {
        self.request.cpu_share = requests;
        self
    }

    /// The number of requests whose processor time this one may take.
    pub fn cpu_share(&self) -> u32 {
        self.request.cpu_share
    }

    /// Processor time that the request has taken.
    pub fn spent(&self) -> &CpuSpent {
        &self.request.spent
    }

    /// Gives this clone of the place back; the place is free once no work of the request has another. The ticket keeps
    /// what the request holds.
    pub fn yield_place(self) -> Ticket {
        self.request
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_client_without_a_place_gets_one_though_others_have_taken_all() {
        let places = Places::new(4);
        let mut held: Vec<Place> = (0..4)
            .map(|flow| places.take(Flow(flow)).unwrap())
            .collect();
        assert!(places.take(Flow(0)).is_none() && !places.has_place(Flow(0)));
        assert!(places.has_place(Flow(9)));
        let other = places.take(Flow(9)).unwrap();
        assert!(places.take(Flow(9)).is_none(), "it has one");
        assert_eq!((places.free(), places.len()), (0, 5));
        // The spare places are bounded, too.
        held.extend((10..13).map(|flow| places.take(Flow(flow)).unwrap()));
        assert!(places.take(Flow(13)).is_none() && !places.has_place(Flow(13)));
        drop((other, held));
        assert_eq!((places.free(), places.len()), (4, 0));
        assert!(lock(&places.taken).is_empty(), "clients are forgotten");
    }
}
