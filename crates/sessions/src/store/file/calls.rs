//! The calls of the store, which are sent to its thread.

use super::super::record::{Record, SessionName, Version};
use super::super::session_store::{
    Commit, Counted, Outcome, SessionStore, StoreFuture, StoreShare, StoreUnavailable,
};
use super::database::{OpenError, Transaction};
use super::durability::Durability;
use super::rules::Fault;
use super::shares::Shares;
use super::writer::{Call, Health, Ruled, Writer};
use crate::clock::{Clock, timeout};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::sync::oneshot;
use uuid::Uuid;

/// The store. When it is dropped, what was written is synced, and the folder is free.
#[derive(Debug)]
pub struct FileStore {
    /// `None` only while the store is dropped: the thread ends once the sender is gone.
    calls: Option<Sender<Box<dyn Call>>>,
    thread: Option<JoinHandle<()>>,
    health: Arc<Health>,
    shares: Shares,
    timeout: Duration,
}

impl FileStore {
    /// The store in this folder, which is made where there is none. Calls end after `timeout`; sessions expire by
    /// `clock`.
    ///
    /// # Errors
    /// See [`OpenError`].
    pub fn open(
        folder: &Path,
        durability: Durability,
        timeout: Duration,
        clock: Clock,
    ) -> Result<Self, OpenError> {
        let health = Arc::new(Health::default());
        let shares = Shares::new(clock.clone());
        let writer = Writer::new(folder.to_owned(), durability, clock, health.clone())?;
        let (sender, calls) = channel();
        let thread = std::thread::Builder::new().name("bagtrack-store".to_owned());
        let thread = thread.spawn(move || writer.run(&calls));
        let thread = thread.map_err(|source| OpenError::io(folder, source))?;
        Ok(Self {
            calls: Some(sender),
            thread: Some(thread),
            health,
            shares,
            timeout,
        })
    }

    /// Sends a rule to the thread, and waits for the result.
    fn call<'a, T: Send + 'static>(
        &'a self,
        rule: impl FnMut(&mut Transaction<'_>) -> Result<T, Fault> + Send + 'static,
    ) -> StoreFuture<'a, T> {
        Box::pin(async move {
            let ended = || StoreUnavailable("its thread has ended".to_owned());
            let (sender, answer) = oneshot::channel();
            let call = Box::new(Ruled {
                rule,
                found: None,
                sender,
            });
            let calls = self.calls.as_ref().ok_or_else(ended)?;
            calls.send(call).map_err(|_| ended())?;
            match timeout(self.timeout, answer).await {
                Ok(answer) => answer.map_err(|_| ended())?,
                Err(_) => {
                    self.health.failures.fetch_add(1, Ordering::Relaxed);
                    if !self.health.is_late.swap(true, Ordering::AcqRel) {
                        tracing::error!("the store gives no answer in time");
                    }
                    Err(StoreUnavailable("time is over".to_owned()))
                }
            }
        })
    }
}

impl Drop for FileStore {
    fn drop(&mut self) {
        self.calls = None;
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has logged its panic.
            let _ = thread.join();
        }
    }
}

impl SessionStore for FileStore {
    fn create<'a>(&'a self, id: Uuid, record: &'a Record) -> StoreFuture<'a, Outcome> {
        let record = record.clone();
        self.call(move |transaction| transaction.create(id, &record))
    }

    fn admit<'a>(&'a self, share: &'a StoreShare, session: Counted) -> StoreFuture<'a, bool> {
        Box::pin(async move {
            if self.shares.admit(share, session) {
                return Ok(true);
            }
            let doubtful = self.shares.doubtful(&share.client);
            let gone = self
                .call(move |transaction| transaction.gone(&doubtful))
                .await?;
            self.shares.remove(&gone);
            Ok(self.shares.admit(share, session))
        })
    }

    fn load(&self, id: Uuid) -> StoreFuture<'_, Option<Record>> {
        self.call(move |transaction| transaction.load(id))
    }

    fn commit(&self, commit: Commit) -> StoreFuture<'_, Outcome> {
        self.call(move |transaction| transaction.commit(&commit))
    }

    fn check(
        &self,
        name: SessionName,
        version: Version,
        takes_over: bool,
        renew: Option<Duration>,
    ) -> StoreFuture<'_, Outcome> {
        self.call(move |transaction| transaction.check(name, version, takes_over, renew))
    }

    fn fence(&self, name: SessionName, version: Version) -> StoreFuture<'_, Outcome> {
        self.call(move |transaction| transaction.fence(name, version))
    }

    fn end(&self, name: SessionName, ttl: Duration) -> StoreFuture<'_, bool> {
        Box::pin(async move {
            let ended = self.call(move |transaction| transaction.end(name, ttl));
            let ended = ended.await?;
            self.shares.remove(&[name]);
            Ok(ended)
        })
    }

    fn secret(&self, new: [u8; 32]) -> StoreFuture<'_, [u8; 32]> {
        self.call(move |transaction| transaction.secret(new))
    }

    fn is_ready(&self) -> bool {
        let Health { is_up, is_late, .. } = &*self.health;
        is_up.load(Ordering::Acquire) && !is_late.load(Ordering::Acquire)
    }

    fn is_full(&self) -> bool {
        self.health.is_full.load(Ordering::Relaxed)
    }

    fn failures(&self) -> u64 {
        self.health.failures.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::timeout;
    use crate::store::record::tests::record;

    const LONG: Duration = Duration::from_secs(60);

    /// A call waits behind one that hangs, and its client is told that it does not count. It must not be done later,
    /// and the store must not be ready meanwhile.
    #[tokio::test(flavor = "multi_thread")]
    async fn a_call_that_was_told_to_have_no_answer_is_not_done_later() {
        let folder = tempfile::tempdir().unwrap();
        let open = |timeout| {
            let clock = Clock::default();
            FileStore::open(folder.path(), Durability::default(), timeout, clock).unwrap()
        };
        let store = open(Duration::from_millis(100));
        let (release, released) = channel::<()>();
        let (begin, begun) = channel();
        let hangs = store.call(move |_| {
            let _ = (begin.send(()), released.recv());
            Ok(())
        });
        let (id, written) = (Uuid::from_u128(1), record(7, 3));
        let late = async {
            // The hanging call is at work, so the next call is of the next group.
            tokio::task::block_in_place(|| begun.recv()).unwrap();
            store.create(id, &written).await
        };
        let (hangs, late) = tokio::join!(hangs, late);
        assert!(hangs.is_err() && late.is_err());
        assert!(!store.is_ready());
        release.send(()).unwrap();
        // The store gets ready without a further call.
        let ready = async {
            while !store.is_ready() {
                tokio::task::yield_now().await;
            }
        };
        timeout(LONG, ready)
            .await
            .expect("the store is ready again");
        drop(store);
        assert_eq!(open(LONG).load(id).await.unwrap(), None);
    }
}
