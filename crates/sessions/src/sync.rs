//! Locks, atomics and threads: those of the system, or with the feature `shuttle` those whose order a test chooses.

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

/// Blocks this thread until something was sent.
///
/// # Errors
/// Nothing will be.
pub(crate) fn wait_for<T>(sent: oneshot::Receiver<T>) -> Result<T, oneshot::error::RecvError> {
    #[cfg(feature = "shuttle")]
    return shuttle::future::block_on(sent);
    #[cfg(not(feature = "shuttle"))]
    sent.blocking_recv()
}
