//! The places in the queue.
//!
//! A client that has none always gets one, however many the others have taken: there are as many places again for that.
//! So some clients with all the requests that they may have in flight do not close the service to the others.

use super::flows::Flow;
use crate::sync::{Mutex, lock};
use std::collections::HashMap;
use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// The places in the queue, and how many of them each client has.
#[derive(Debug)]
pub(super) struct Places {
    queue: Arc<Semaphore>,
    /// For clients that have no place.
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
    /// So many, and as many for clients that have none.
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

    /// The same, but waits for a place, in order of arrival.
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
        // Those places are bounded, too.
        held.extend((10..13).map(|flow| places.take(Flow(flow)).unwrap()));
        assert!(places.take(Flow(13)).is_none() && !places.has_place(Flow(13)));
        drop((other, held));
        assert_eq!((places.free(), places.len()), (4, 0));
        assert!(lock(&places.taken).is_empty(), "clients are forgotten");
    }
}
