//! Places for the processes that decode videos, and whether somebody waits for one.

use bagtrack_sessions::clock::{Instant, sleep_until, timeout_at};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};

/// The places for processes that decode videos, in order of arrival.
#[derive(Debug, Clone)]
pub struct VideoPlaces {
    free: Arc<Semaphore>,
    all: usize,
    /// Who waits for one, and whether it is promised one that is given up.
    waiting: watch::Sender<Vec<IsPromised>>,
}

type IsPromised = Arc<AtomicBool>;

/// One that waits.
struct Waiting<'a> {
    all: &'a watch::Sender<Vec<IsPromised>>,
    own: IsPromised,
}

impl VideoPlaces {
    /// So many places.
    pub fn new(all: usize) -> Self {
        Self {
            free: Arc::new(Semaphore::new(all)),
            all,
            waiting: watch::Sender::default(),
        }
    }

    /// How many are taken.
    pub fn taken(&self) -> usize {
        self.all.saturating_sub(self.free.available_permits())
    }

    /// Waits for a place until `deadline`; none where there is none until then.
    pub async fn take_until(&self, deadline: Instant) -> Option<OwnedSemaphorePermit> {
        let _waiting = Waiting::among(&self.waiting);
        let place = timeout_at(deadline, self.free.clone().acquire_owned()).await;
        place.ok()?.ok()
    }

    /// Ready when it is `from` or later, and somebody waits for a place whom no other one is promised. The place has to
    /// be given up then.
    pub async fn wanted_from(&self, from: Instant) {
        sleep_until(from).await;
        let mut waiting = self.waiting.subscribe();
        let promise = |own: &IsPromised| !own.swap(true, Ordering::Relaxed);
        // Its sender is `self`.
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
