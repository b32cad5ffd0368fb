//! Whether something is so full that a load balancer should look elsewhere: the queue, or the memory of uploads.

use std::sync::atomic::{AtomicBool, Ordering};

/// Whether something was found full. It counts as full until half of it is free, so that the answer does not flicker.
#[derive(Debug, Default)]
pub struct Saturation(AtomicBool);

impl Saturation {
    /// Whether it counts as full, now that `free` of its `all` places are free.
    pub fn update(&self, free: usize, all: usize) -> bool {
        // A tenth of the places, and half of them.
        let (fills, empties) = (free <= all / 10, free * 2 >= all);
        let before = self.0.load(Ordering::Relaxed);
        let now = if before { !empties } else { fills };
        self.0.store(now, Ordering::Relaxed);
        now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_queue_that_was_full_counts_as_full_until_half_of_it_is_free() {
        let saturation = Saturation::default();
        let free = [100, 11, 10, 11, 49, 50, 11, 0, 30];
        let found = free.map(|free| saturation.update(free, 100));
        let expected = [false, false, true, true, true, false, false, true, true];
        assert_eq!(found, expected);
        let single = Saturation::default();
        assert!(single.update(0, 1));
        assert!(!single.update(1, 1));
    }
}
