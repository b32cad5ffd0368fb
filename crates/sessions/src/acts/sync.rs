//! Synchronises the sessions in memory with the store: loads newer states, renews the time to live, and writes states
//! outside of requests.
//!
//! Memory is a cache of the store: another replica may have gone on with a session that is in memory here.

use super::error::ActError;
use super::service::SessionService;
use crate::clock::timeout;
use crate::planted::PlantedFault;
use crate::store::{Commit, Gone, Intent, Outcome, Step, StoreUnavailable, reconcile};
use crate::{
    Flow, LockedSession, NoSession, QueuePermit, Session, SessionBusy, SessionPermit, SessionState,
    Stopped, WorkMeter,
};
use std::sync::Arc;
use std::time::Duration;

/// How often fencing a session is tried: each time another replica may commit a frame first.
const MAX_ATTEMPTS: usize = 4;
/// A session whose record is gone has expired if no more than this was left of its time to live, and was lost
/// otherwise. The second allows for inexact clocks and slow answers.
const LATE: Duration = Duration::from_secs(1);

impl SessionService {
    /// Waits for the session's lock, and brings its state up to the store's. `takes_over` is true where frames will be
    /// tracked here.
    pub(super) async fn lock_newest(
        &self,
        permit: SessionPermit,
        flow: Flow,
        takes_over: bool,
    ) -> Result<LockedSession, ActError> {
        let locked = permit.lock().await?;
        let step = self.ask(locked.session(), takes_over).await;
        self.follow(locked, step, flow).await
    }

    /// Waits for the session's lock, brings its state up to the store's, and runs `read` on the state on a worker.
    ///
    /// # Errors
    /// The session has ended, the store gives no answer, time is over, or the error of `read` itself.
    pub async fn read<T, E, F>(
        &self,
        permit: SessionPermit,
        queue: QueuePermit,
        read: F,
    ) -> Result<T, E>
    where
        T: Send + 'static,
        E: From<ActError> + Send + 'static,
        F: FnOnce(&SessionState) -> Result<T, E> + Send + 'static,
    {
        let newest = self.lock_newest(permit, queue.flow(), false);
        let newest = timeout(self.settings.work_timeout, newest).await;
        let newest = newest.map_err(|_| ActError::from(Stopped::Deadline))?;
        let mut locked = newest?;
        self.run(queue, move |_: &mut WorkMeter| read(locked.state()))
            .await
    }

    /// The session as a signed snapshot.
    ///
    /// # Errors
    /// See [`Self::read`].
    pub async fn snapshot(
        &self,
        permit: SessionPermit,
        queue: QueuePermit,
    ) -> Result<Vec<u8>, ActError> {
        let keys = self.keys.clone();
        self.read(permit, queue, move |state| Ok(state.snapshot(&keys)))
            .await
    }

    /// Brings the last answer of a session up to the store's. Waits for a frame that is being tracked here only if the
    /// store has a newer one. `permit` is the permit of the caller's request, if it has one.
    ///
    /// # Errors
    /// The session has ended, or the store gives no answer.
    pub async fn refresh(
        &self,
        session: &Arc<Session>,
        permit: Option<&SessionPermit>,
        flow: Flow,
    ) -> Result<(), ActError> {
        let before = session.version();
        match self.ask(session, false).await {
            Step::Commit(ttl) => {
                if self.store.is_some() {
                    session.set_ttl(ttl);
                }
                Ok(())
            }
            step @ (Step::GoOn(_) | Step::Conflict(_)) => {
                let permit = match permit {
                    Some(permit) => permit.share(),
                    None => session.read_permit()?,
                };
                let locked = permit.lock().await?;
                // This replica may itself have committed the newer frame meanwhile.
                let step = match session.version() == before {
                    true => step,
                    false => self.ask(session, false).await,
                };
                self.follow(locked, step, flow).await.map(drop)
            }
            step => Err(self.refusal(session, step)),
        }
    }

    /// Waits for the session's lock, brings its state up to the store's, and begins the record's next generation, so
    /// that no other replica goes on from its own copy.
    ///
    /// # Errors
    /// The session has ended, the store gives no answer, or time is over.
    pub async fn fence(
        &self,
        permit: SessionPermit,
        flow: Flow,
    ) -> Result<LockedSession, ActError> {
        let fenced = timeout(self.settings.work_timeout, self.lock_fenced(permit, flow));
        fenced.await.map_err(|_| Stopped::Deadline)?
    }

    async fn lock_fenced(
        &self,
        permit: SessionPermit,
        flow: Flow,
    ) -> Result<LockedSession, ActError> {
        let mut locked = permit.lock().await?;
        let Some(store) = &self.store else {
            return Ok(locked);
        };
        for _ in 0..MAX_ATTEMPTS {
            let session = locked.session().clone();
            let Some(version) = session.version() else {
                return Ok(locked);
            };
            let is_planted = PlantedFault::BeginsWithoutFence.is_here();
            let outcome = match is_planted {
                true => store.check(session.name(), version, true, None).await,
                false => store.fence(session.name(), version).await,
            };
            let step = reconcile(session.name().incarnation, Intent::Newest, outcome);
            let is_fenced = matches!(step, Step::Commit(_));
            locked = self.follow(locked, step, flow).await?;
            if is_fenced {
                if !is_planted {
                    locked.fenced();
                }
                return Ok(locked);
            }
        }
        Err(SessionBusy.into())
    }

    /// Renews a session's time to live, in the store too if `in_store`. For frames that were refused for want of room
    /// or time; other refused frames do not keep their session alive.
    pub async fn renew(&self, session: &Session, in_store: bool) {
        session.renew();
        if let (true, Some(store), Some(version)) = (in_store, &self.store, session.version()) {
            let ttl = Some(self.registry.idle_lease());
            // If the store gives no answer, the record's time to live is not renewed.
            let _ = store.check(session.name(), version, false, ttl).await;
        }
    }

    /// Asks the store whether the copy of a session is the newest.
    pub(super) async fn ask(&self, session: &Session, takes_over: bool) -> Step {
        let outcome = match (&self.store, session.version()) {
            (Some(store), Some(version)) => {
                let checked = store.check(session.name(), version, takes_over, None);
                checked.await
            }
            _ => Ok(Outcome::Committed(session.ttl())),
        };
        reconcile(session.name().incarnation, Intent::Newest, outcome)
    }

    /// Follows the store's `step` with a locked session: notes its time to live, or loads the store's state.
    async fn follow(
        &self,
        locked: LockedSession,
        step: Step,
        flow: Flow,
    ) -> Result<LockedSession, ActError> {
        match step {
            Step::Commit(ttl) => {
                if self.store.is_some() {
                    locked.session().set_ttl(ttl);
                }
                Ok(locked)
            }
            Step::GoOn(record) | Step::Conflict(record) => {
                self.take_over(locked, *record, flow).await
            }
            step => Err(self.refusal(locked.session(), step)),
        }
    }

    /// Why a session cannot be used after this step. Drops the session from memory, unless the store gave no answer.
    pub(super) fn refusal(&self, session: &Arc<Session>, step: Step) -> ActError {
        let error = match step {
            Step::Unavailable(unavailable) => return unavailable.into(),
            Step::Gone(Gone::Ended) => NoSession::Unknown.into(),
            Step::Gone(Gone::NoRecord) if session.ttl() > LATE => NoSession::Lost.into(),
            Step::Gone(Gone::NoRecord) => NoSession::Expired.into(),
            // For a replaced session: the next request with this id finds the new one.
            Step::Replaced(_) | Step::Commit(_) | Step::GoOn(_) | Step::Conflict(_) => {
                SessionBusy.into()
            }
        };
        self.registry.forget(session);
        error
    }

    /// Writes the states of all sessions whose last frames have no checkpoint.
    pub async fn flush(&self) {
        for session in self.registry.all() {
            let is_behind = |session: &Session| {
                let checkpoint = session.checkpoint();
                checkpoint.is_some_and(|checkpoint| checkpoint < session.latest_frame())
            };
            if is_behind(&session)
                && let Ok(permit) = session.read_permit()
                && let Ok(mut locked) = permit.lock().await
                && is_behind(&session)
            {
                let name = session.short_id();
                match self.write(&mut locked).await {
                    Ok(true) => {}
                    Ok(false) => tracing::debug!(session = name, "another replica has it"),
                    Err(error) => tracing::error!(%error, session = name, "not written"),
                }
            }
        }
    }

    /// Writes a session's state to the store. False if the store has another version of the session.
    async fn write(&self, locked: &mut LockedSession) -> Result<bool, StoreUnavailable> {
        let session = locked.session().clone();
        let (Some(store), Some(before)) = (&self.store, session.version()) else {
            return Ok(true);
        };
        let (bytes, frame) = (locked.state().stored(), locked.state().latest_frame());
        let commit = Commit {
            name: session.name(),
            before,
            frame,
            state: Some(bytes.into()),
            takes_over: false,
            // The full time, not what is left of it: after a jump of this machine's clock that may be nothing, and the
            // store would drop the record.
            ttl: self.registry.idle_lease(),
        };
        let is_written = matches!(store.commit(commit).await?, Outcome::Committed(_));
        if is_written {
            session.set_version(Some(before.committed(frame, true)));
        }
        Ok(is_written)
    }
}
