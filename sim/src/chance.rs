//! All random choices of a run. They follow from its seed.

use rand::distr::uniform::{SampleRange, SampleUniform};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// The source of random choices. Clones draw from one sequence, in a single thread always in the same order.
#[derive(Debug, Clone)]
pub struct Chance(Arc<Mutex<ChaCha8Rng>>);

impl Chance {
    pub fn new(seed: u64) -> Self {
        Self(Arc::new(Mutex::new(ChaCha8Rng::seed_from_u64(seed))))
    }

    pub fn happens(&self, probability: f64) -> bool {
        // Nothing is drawn for a probability of 0, so a fault that is switched off leaves all other choices as they
        // are.
        probability > 0.0 && self.draw(|rng| rng.random_bool(probability))
    }

    /// A number of this range, which is not empty.
    pub fn between<T: SampleUniform>(&self, range: impl SampleRange<T>) -> T {
        self.draw(|rng| rng.random_range(range))
    }

    pub fn millis(&self, range: impl SampleRange<u64>) -> Duration {
        Duration::from_millis(self.between(range))
    }

    /// One of these; there must be at least one.
    pub fn one_of<'a, T>(&self, among: &'a [T]) -> &'a T {
        &among[self.between(0..among.len())]
    }

    pub fn number(&self) -> u128 {
        self.draw(|rng| rng.random())
    }

    fn draw<T>(&self, draw: impl FnOnce(&mut ChaCha8Rng) -> T) -> T {
        draw(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
