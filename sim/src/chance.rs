//! All random choices of a run. They follow from its seed.

use rand::distr::uniform::{SampleRange, SampleUniform};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// The choices. Clones draw from the same numbers: in one thread they do so in the same order each time.
#[derive(Debug, Clone)]
pub struct Chance(Arc<Mutex<ChaCha8Rng>>);

impl Chance {
    pub fn new(seed: u64) -> Self {
        Self(Arc::new(Mutex::new(ChaCha8Rng::seed_from_u64(seed))))
    }

    pub fn happens(&self, probability: f64) -> bool {
        // Without a draw where it is certain, so that a fault that is off changes nothing else.
        probability > 0.0 && self.draw(|rng| rng.random_bool(probability))
    }

    /// A number of this range, which is not empty.
    pub fn between<T: SampleUniform>(&self, range: impl SampleRange<T>) -> T {
        self.draw(|rng| rng.random_range(range))
    }

    pub fn millis(&self, range: impl SampleRange<u64>) -> Duration {
        Duration::from_millis(self.between(range))
    }

    /// One of these, of which there is one.
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
