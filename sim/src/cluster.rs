//! The replicas of a run, which are killed, drained and started again.

use crate::replica::{Replica, Setup};
use bagtrack_sessions::clock::sleep;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

pub const REPLICAS: usize = 3;

/// The replicas. Clones share them.
#[derive(Debug, Clone)]
pub struct Cluster {
    setup: Setup,
    places: Arc<Mutex<Vec<Place>>>,
}

#[derive(Debug, Default)]
struct Place {
    /// `None` while no replica runs here.
    replica: Option<Replica>,
    /// Whether the load balancer sends new requests to this place.
    is_ready: bool,
    lives: u32,
}

impl Cluster {
    pub async fn start(setup: Setup) -> Self {
        let places = (0..REPLICAS).map(|_| Place::default()).collect();
        let cluster = Self {
            setup,
            places: Arc::new(Mutex::new(places)),
        };
        for index in 0..REPLICAS {
            cluster.start_one(index).await;
        }
        cluster
    }

    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Starts a replica in this place, unless one lives there.
    pub async fn start_one(&self, index: usize) {
        let lives = {
            let place = &mut self.lock()[index];
            place.lives += 1;
            place.lives
        };
        let replica = Replica::start(&self.setup, format!("replica {index}.{lives}")).await;
        let mut places = self.lock();
        let place = &mut places[index];
        if place.replica.as_ref().is_none_or(|old| old.life.is_dead()) {
            *place = Place {
                replica: Some(replica),
                is_ready: true,
                lives,
            };
        } else {
            replica.life.end();
        }
    }

    /// The replica in this place, if one lives there.
    pub fn at(&self, index: usize) -> Option<Replica> {
        let replica = self.lock()[index].replica.clone();
        replica.filter(|replica| !replica.life.is_dead())
    }

    /// The indices of the places to which the load balancer sends requests.
    pub fn ready(&self) -> Vec<usize> {
        let places = self.lock();
        let is_ready = |place: &Place| {
            let lives = place
                .replica
                .as_ref()
                .map(|replica| !replica.life.is_dead());
            place.is_ready && lives == Some(true)
        };
        (0..REPLICAS)
            .filter(|index| is_ready(&places[*index]))
            .collect()
    }

    pub fn kill(&self, index: usize) {
        if let Some(replica) = self.at(index) {
            self.setup
                .trace
                .note(format_args!("{} killed", replica.name));
            replica.life.end();
        }
        self.lock()[index].replica = None;
    }

    /// Asks a replica to end, which it does after `delay`.
    pub async fn drain(&self, index: usize, delay: Duration) {
        let Some(replica) = self.at(index) else {
            return;
        };
        self.setup
            .trace
            .note(format_args!("{} drains", replica.name));
        self.lock()[index].is_ready = false;
        replica.service.drain();
        let flushed = replica.service.clone();
        tokio::spawn(replica.life.run(async move { flushed.flush().await }));
        sleep(delay).await;
        let last = replica.clone();
        let ending = async move {
            last.end_connections().await;
            last.service.flush().await;
        };
        let _ = replica.life.run(ending).await;
        self.setup.trace.note(format_args!("{} ends", replica.name));
        replica.life.end();
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Place>> {
        self.places.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
