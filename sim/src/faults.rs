//! The kinds of faults of a run, and how often they happen. Each seed draws some kinds: a run with all at once would
//! not get far.

use crate::chance::Chance;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The probability of each fault, for each message. Clones are switched off together.
#[derive(Debug, Clone)]
pub struct Rates {
    is_on: Arc<AtomicBool>,
    /// A message to or from the store takes long.
    pub late: f64,
    /// A script does not reach the store.
    pub store_lost: f64,
    /// A script ran, and its answer is lost.
    pub store_answer_lost: f64,
    /// A script reaches the store again, whether its first message arrived or was lost.
    pub store_doubled: f64,
    /// A request does not reach a replica.
    pub request_lost: f64,
    pub answer_lost: f64,
    pub request_doubled: f64,
    /// A request or an answer takes long.
    pub request_late: f64,
    /// The caller does not wait for the answer.
    pub given_up: f64,
}

/// The faults of replicas and the store, each with its weight: the probability that an event is this fault is its share
/// of the sum.
#[derive(Debug, Clone)]
pub struct Events {
    /// A replica is killed, at once or at a random await point.
    pub kill: u32,
    /// A replica is asked to end, and ends some time later.
    pub drain: u32,
    pub store_away: u32,
    pub store_slow: u32,
    /// The store is restarted, with its keys.
    pub store_restart: u32,
    /// The clock of a replica jumps forward.
    pub clock_jump: u32,
}

impl Rates {
    pub fn draw(chance: &Chance) -> Self {
        let rate = |most: f64| match chance.happens(0.5) {
            true => chance.between(0.0..most),
            false => 0.0,
        };
        Self {
            is_on: Arc::new(AtomicBool::new(true)),
            late: rate(0.1),
            store_lost: rate(0.1),
            store_answer_lost: rate(0.1),
            store_doubled: rate(0.2),
            request_lost: rate(0.1),
            answer_lost: rate(0.2),
            request_doubled: rate(0.2),
            request_late: rate(0.1),
            given_up: rate(0.2),
        }
    }

    pub fn happens(&self, chance: &Chance, rate: f64) -> bool {
        self.is_on.load(Ordering::Relaxed) && chance.happens(rate)
    }

    /// From now on nothing goes wrong.
    pub fn end(&self) {
        self.is_on.store(false, Ordering::Relaxed);
    }
}

impl Events {
    pub fn draw(chance: &Chance) -> Self {
        let weight = || {
            if chance.happens(0.5) {
                chance.between(1..10)
            } else {
                0
            }
        };
        Self {
            kill: weight(),
            drain: weight(),
            store_away: weight(),
            store_slow: weight(),
            store_restart: weight(),
            clock_jump: weight(),
        }
    }
}
