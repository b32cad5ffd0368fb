//! Work that is done on the thread on which its request came in: nobody is woken for it, nor for its answer.
//!
//! What could go wrong: a thread that works serves none of its connections meanwhile. So only brief work is done
//! there, only where no worker is busy, only on a thread that says that it takes work ([`rested`]), and not twice before it has
//! waited for something to do: then all its connections have been served in between.

use std::cell::Cell;

thread_local! {
    /// Whether this thread has waited since it last worked; never on one that takes no work.
    static RESTED: Cell<bool> = const { Cell::new(false) };
}

/// This thread takes brief work, and is about to wait for something to do.
pub fn rested() {
    RESTED.set(true);
}

/// Whether this thread takes the work that there is now.
pub(super) fn takes_work() -> bool {
    RESTED.take()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread;

    #[test]
    fn a_thread_takes_work_once_each_time_that_it_says_so() {
        let asked = || {
            assert!(!takes_work());
            rested();
            rested();
            assert!(takes_work());
            assert!(!takes_work());
            rested();
            assert!(takes_work());
        };
        thread::spawn(asked).join().expect("as it should");
    }
}
