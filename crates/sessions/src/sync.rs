//! Locks, atomics and threads: those of `std`, or with the feature `shuttle` those whose order a test chooses.

use tokio::sync::oneshot;

#[cfg(feature = "shuttle")]
pub(crate) use shuttle::{
    sync::{Condvar, Mutex, MutexGuard, PoisonError, atomic},
    thread,
};
#[cfg(not(feature = "shuttle"))]
pub(crate) use std::{
    sync::{Condvar, Mutex, MutexGuard, PoisonError, atomic},
    thread,
};

/// Takes a lock. Nothing panics while a lock is held, so a poisoned one still guards whole data.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Blocks this thread until the value was sent.
///
/// # Errors
/// The sender is gone.
pub(crate) fn wait_for<T>(sent: oneshot::Receiver<T>) -> Result<T, oneshot::error::RecvError> {
    #[cfg(feature = "shuttle")]
    return shuttle::future::block_on(sent);
    #[cfg(not(feature = "shuttle"))]
    sent.blocking_recv()
}
