//! The one place that draws random numbers: ids, names of writes, seeds of trackers.
//!
//! The numbers come from the thread's generator, which the system seeds. A simulation has one thread and seeds its
//! generator, so that each run is the same.

use rand::distr::uniform::{SampleRange, SampleUniform};
use rand::distr::{Distribution, StandardUniform};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::cell::RefCell;
use uuid::Uuid;

thread_local! {
    static SEEDED: RefCell<Option<ChaCha8Rng>> = const { RefCell::new(None) };
}

/// From now on all numbers of this thread follow from `seed`. For simulations only: who knows the seed knows all ids
/// and keys.
pub fn seed_this_thread(seed: u64) {
    SEEDED.set(Some(ChaCha8Rng::seed_from_u64(seed)));
}

/// A number drawn from all values of its type.
pub fn random<T>() -> T
where
    StandardUniform: Distribution<T>,
{
    SEEDED.with_borrow_mut(|seeded| match seeded {
        Some(seeded) => seeded.random(),
        None => rand::rng().random(),
    })
}

/// A number drawn from this range, which must not be empty.
pub fn random_range<T: SampleUniform>(range: impl SampleRange<T>) -> T {
    SEEDED.with_borrow_mut(|seeded| match seeded {
        Some(seeded) => seeded.random_range(range),
        None => rand::rng().random_range(range),
    })
}

/// A new id.
pub fn new_id() -> Uuid {
    uuid::Builder::from_random_bytes(random()).into_uuid()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seeded_thread_draws_the_same_again_and_others_do_not() {
        let drawn = || (new_id(), random::<u64>(), random_range(0..1000));
        let seeded = |seed| {
            let thread = std::thread::spawn(move || {
                seed_this_thread(seed);
                drawn()
            });
            thread.join().unwrap()
        };
        assert_eq!(seeded(1), seeded(1));
        assert_ne!(seeded(1), seeded(2));
        assert_ne!(drawn(), drawn());
        assert_eq!(drawn().0.get_version_num(), 4);
    }
}
