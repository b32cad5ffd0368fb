//! Places for the processes that decode videos. Whoever has a place can learn when another request waits for one.

use bagtrack_sessions::clock::{Instant, sleep_until, timeout_at};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};

/// The places for processes that decode videos, in order of arrival.
#[derive(Debug, Clone)]
pub struct VideoPlaces {
    free: Arc<Semaphore>,
    all: usize,
    /// For each waiting request, whether a place that is being given up is promised to it.
    waiting: watch::Sender<Vec<IsPromised>>,
}

type IsPromised = Arc<AtomicBool>;

/// A request that waits, as long as this lives.
struct Waiting<'a> {
    all: &'a watch::Sender<Vec<IsPromised>>,
    own: IsPromised,
}

impl VideoPlaces {
    /// `all` places.
    pub fn new(all: usize) -> Self {
        Self {
            free: Arc::new(Semaphore::new(all)),
            all,
            waiting: watch::Sender::default(),
        }
    }

    /// How many places there are.
    pub fn all(&self) -> usize {
        self.all
    }

    /// How many places are taken.
    pub fn taken(&self) -> usize {
        self.all.saturating_sub(self.free.available_permits())
    }

    /// Waits for a place until `deadline`; `None` where none is free by then.
    pub async fn take_until(&self, deadline: Instant) -> Option<OwnedSemaphorePermit> {
        let _waiting = Waiting::among(&self.waiting);
        let place = timeout_at(deadline, self.free.clone().acquire_owned()).await;
        place.ok()?.ok()
    }

    /// Waits until `from`, and then until a request waits for a place to which none is promised yet. The caller's place
    /// is promised to that request, so the caller has to give it up.
    pub async fn wanted_from(&self, from: Instant) {
        sleep_until(from).await;
        let mut waiting = self.waiting.subscribe();
        let promise = |own: &IsPromised| !own.swap(true, Ordering::Relaxed);
        // The sender is in `self`, so the channel is open.
        let _ = waiting.wait_for(|all| all.iter().any(promise)).await;
    }
}

impl<'a> Waiting<'a> {
    fn among(all: &'a watch::Sender<Vec<IsPromised>>) -> Self {
        let own = IsPromised::default();
        all.send_modify(|all| all.push(own.clone()));
        Self { all, own }
    }
}

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        let others = |one: &IsPromised| !Arc::ptr_eq(one, &self.own);
        self.all.send_modify(|all| all.retain(others));
    }
}
