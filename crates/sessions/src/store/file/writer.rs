//! The thread that does all calls, in groups that are written together.

use super::database::{Database, GONE, OpenError, Transaction};
use super::durability::Durability;
use super::rules::Fault;
use super::time::{Noted, Time};
use crate::clock::{Clock, Instant, now};
use crate::store::session_store::StoreUnavailable;
use fjall::PersistMode;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;
use tokio::sync::oneshot;

/// Most calls that are written together.
const GROUP: usize = 256;
/// Least time between two sweeps of expired entries.
const SWEEP: Duration = Duration::from_secs(1);
/// Least and most time before a database that failed is opened again.
const REOPEN: (Duration, Duration) = (Duration::from_millis(250), Duration::from_secs(4));

/// The thread's state that its callers read.
#[derive(Debug, Default)]
pub(super) struct Health {
    pub(super) is_up: AtomicBool,
    /// Whether a call got no answer in time, and nothing was written since.
    pub(super) is_late: AtomicBool,
    /// Whether the disk was nearly full when it was looked at last.
    pub(super) is_full: AtomicBool,
    pub(super) failures: AtomicU64,
}

/// A call on its way to the thread.
pub(super) trait Call: Send {
    /// Does the call in a transaction, and keeps the result. False where it could not be done.
    fn run(&mut self, transaction: &mut Transaction<'_>) -> bool;
    /// Whether nobody waits for the answer any more: the caller's time is over.
    fn is_given_up(&self) -> bool;
    /// Sends the result, or the reason why the transaction was not written.
    fn answer(self: Box<Self>, written: Result<(), StoreUnavailable>);
}

/// A call that applies a rule to the transaction.
pub(super) struct Ruled<T, F> {
    pub(super) rule: F,
    pub(super) found: Option<Result<T, Fault>>,
    pub(super) sender: oneshot::Sender<Result<T, StoreUnavailable>>,
}

impl<T, F> Call for Ruled<T, F>
where
    T: Send,
    F: FnMut(&mut Transaction<'_>) -> Result<T, Fault> + Send,
{
    fn run(&mut self, transaction: &mut Transaction<'_>) -> bool {
        let found = self.found.insert((self.rule)(transaction));
        if let Err(error) = found {
            tracing::error!(%error, "a session in the store cannot be read");
        }
        found.is_ok()
    }

    fn is_given_up(&self) -> bool {
        self.sender.is_closed()
    }

    fn answer(self: Box<Self>, written: Result<(), StoreUnavailable>) {
        let Self { found, sender, .. } = *self;
        let found = found.map(|found| found.map_err(|fault| StoreUnavailable(fault.to_string())));
        let unasked = || Err(StoreUnavailable("it was not asked".to_owned()));
        let answer = written.and_then(|()| found.unwrap_or_else(unasked));
        // The caller may have gone.
        let _ = sender.send(answer);
    }
}

/// The state of the thread.
pub(super) struct Writer {
    folder: PathBuf,
    durability: Durability,
    time: Time,
    health: Arc<Health>,
    /// `None` while its files cannot be written.
    database: Option<Database>,
    /// When what was written last has to be synced.
    sync_due: Option<Instant>,
    sweep_due: Instant,
    reopen_due: Instant,
    pause: Duration,
    /// Why the database could not be written the last time.
    reason: String,
}

impl Writer {
    /// Opens the database.
    ///
    /// # Errors
    /// See [`OpenError`].
    pub(super) fn new(
        folder: PathBuf,
        durability: Durability,
        clock: Clock,
        health: Arc<Health>,
    ) -> Result<Self, OpenError> {
        let database = Database::open(&folder)?;
        let noted = database
            .noted_time()
            .map_err(|error| OpenError::of(&folder, error))?;
        health.is_up.store(true, Ordering::Release);
        let begun = now();
        Ok(Self {
            folder,
            durability,
            time: Time::new(clock, noted),
            health,
            database: Some(database),
            sync_due: None,
            sweep_due: begun,
            reopen_due: begun,
            pause: REOPEN.0,
            reason: String::new(),
        })
    }

    /// Does calls until nobody can send one any more.
    pub(super) fn run(mut self, calls: &Receiver<Box<dyn Call>>) {
        loop {
            match calls.recv_timeout(self.idle_time()) {
                Ok(first) => {
                    let waiting = calls.try_iter().take(GROUP - 1);
                    let group = std::iter::once(first).chain(waiting).collect();
                    self.do_group(group);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            self.maintain();
            self.note_time(self.time.due());
        }
        self.note_time(self.time.due());
        if let Some(Err(error)) = self.database.as_ref().map(Database::sync) {
            tracing::error!(%error, "the store cannot be synced");
        }
    }

    /// How long the thread may wait for a call until something else is due.
    fn idle_time(&self) -> Duration {
        let due = match self.database {
            Some(_) => self.sync_due.unwrap_or(self.sweep_due).min(self.sweep_due),
            None => self.reopen_due,
        };
        due.saturating_duration_since(now())
    }

    fn do_group(&mut self, mut group: Vec<Box<dyn Call>>) {
        // A frame that its client was told is not counted must not be committed later.
        group.retain(|call| !call.is_given_up());
        if group.is_empty() {
            return;
        }
        let written = self.write(&mut group);
        let unavailable = written.err().map(StoreUnavailable);
        if let Some(unavailable) = &unavailable {
            let calls = u64::try_from(group.len()).unwrap_or(u64::MAX);
            self.health.failures.fetch_add(calls, Ordering::Relaxed);
            tracing::debug!(reason = unavailable.0, calls, "not written");
        }
        for call in group {
            call.answer(unavailable.clone().map_or(Ok(()), Err));
        }
    }

    /// Runs the calls in one transaction, and writes it.
    fn write(&mut self, group: &mut [Box<dyn Call>]) -> Result<(), String> {
        let Some(database) = &mut self.database else {
            return Err("its files could not be written lately".to_owned());
        };
        let (time, durability) = (self.time.now(), self.durability);
        let mut failures = 0;
        // Files that were damaged since they were opened may break an assumption of the database.
        let result = catch_unwind(AssertUnwindSafe(|| {
            let mut transaction = database.begin(time);
            for call in group.iter_mut() {
                failures += u64::from(!call.run(&mut transaction));
            }
            let mode = match durability {
                Durability::Each if transaction.written.promises => PersistMode::SyncData,
                _ => PersistMode::Buffer,
            };
            let written = transaction.write(mode)?;
            database.account(&written)?;
            Ok::<bool, fjall::Error>(written.promises)
        }));
        self.health.failures.fetch_add(failures, Ordering::Relaxed);
        match result {
            Ok(Ok(promises)) => {
                if let (Durability::Every(pause), true) = (durability, promises) {
                    self.sync_due.get_or_insert_with(|| now() + pause);
                }
                self.health.is_late.store(false, Ordering::Release);
                Ok(())
            }
            Ok(Err(error)) => Err(self.fail(&error.to_string())),
            Err(_) => Err(self.fail("the database could not make sense of its files")),
        }
    }

    /// Closes the database, whose files could not be written.
    fn fail(&mut self, reason: &str) -> String {
        if self.health.is_up.swap(false, Ordering::AcqRel) || self.reason != reason {
            tracing::error!(reason, "the store cannot be written");
            reason.clone_into(&mut self.reason);
        }
        self.database = None;
        self.sync_due = None;
        self.reopen_due = now() + self.pause;
        self.pause = (2 * self.pause).min(REOPEN.1);
        reason.to_owned()
    }

    /// Does what is due: opens the database again, syncs, probes or sweeps it.
    fn maintain(&mut self) {
        let begun = now();
        let Some(database) = &mut self.database else {
            if begun >= self.reopen_due {
                self.reopen();
            }
            return;
        };
        if self.sync_due.is_some_and(|due| begun >= due) {
            self.sync_due = None;
            if let Err(error) = database.sync() {
                self.fail(&error.to_string());
                return;
            }
        }
        if self.health.is_late.load(Ordering::Acquire) {
            // A store that is not ready may get no calls, so the thread finds out by itself whether it can write.
            if let Err(error) = database.probe() {
                self.fail(&error.to_string());
                return;
            }
            self.health.is_late.store(false, Ordering::Release);
        }
        if begun >= self.sweep_due {
            if !database.is_there() {
                self.fail(GONE);
                return;
            }
            let is_full = database.is_nearly_full();
            self.health.is_full.store(is_full, Ordering::Relaxed);
            let time = self.time.now();
            let swept = catch_unwind(AssertUnwindSafe(|| database.sweep(time)));
            let took = begun.elapsed();
            match swept {
                Ok(Ok(true)) => self.sweep_due = now() + took,
                Ok(Ok(false)) => self.sweep_due = now() + SWEEP.max(20 * took),
                Ok(Err(error)) => drop(self.fail(&error.to_string())),
                Err(_) => drop(self.fail("the database could not make sense of its files")),
            }
        }
    }

    /// Writes the note of the time, where it is due.
    fn note_time(&mut self, due: Option<Noted>) {
        let (Some(database), Some(noted)) = (&mut self.database, due) else {
            return;
        };
        match database.note_time(noted) {
            Ok(()) => self.time.note(noted),
            Err(error) => drop(self.fail(&error.to_string())),
        }
    }

    fn reopen(&mut self) {
        let opened = Database::open_again(&self.folder).map_err(|error| error.to_string());
        let probed = opened.and_then(|database| {
            let probed = database.probe().map_err(|error| error.to_string());
            probed.map(|()| database)
        });
        match probed {
            Ok(database) => {
                self.database = Some(database);
                self.pause = REOPEN.0;
                self.health.is_up.store(true, Ordering::Release);
                tracing::info!("the store can be written again");
            }
            Err(reason) => drop(self.fail(&reason)),
        }
    }
}
