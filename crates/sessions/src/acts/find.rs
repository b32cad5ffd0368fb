//! Finds sessions, in memory or in the store, and ends them.

use super::error::ActError;
use super::service::SessionService;
use crate::planted::PlantedFault;
use crate::store::{Record, SessionName, Step, StoreUnavailable};
use crate::{
    Flow, LockedSession, NewSession, NoSession, Owner, Session, SessionState, SnapshotError,
    WorkMeter, short_id,
};
use std::sync::Arc;
use std::time::Duration;
use uuid::Uuid;

/// How long at most the store keeps the mark of an ended session: much longer than any request takes. After that the
/// session is unknown. Marks count against nobody's quota.
const TOMBSTONE: Duration = Duration::from_secs(600);

impl SessionService {
    /// The live session of this id and owner, from memory or from the store.
    ///
    /// # Errors
    /// There is no such session, or the store gives no answer.
    pub async fn find(
        &self,
        id: Uuid,
        owner: &Owner,
        flow: Flow,
    ) -> Result<Arc<Session>, ActError> {
        let missing = match self.registry.find(id, owner) {
            Ok(session) => return Ok(session),
            Err(missing) => missing,
        };
        let session = self.load(id, flow).await?.ok_or(missing)?;
        match session.owner() == owner {
            true => Ok(session),
            false => Err(NoSession::Unknown.into()),
        }
    }

    /// The session that has this id in the store, whoever owns it. Without a store, the session in memory.
    pub(super) async fn find_authoritative(
        &self,
        id: Uuid,
        flow: Flow,
    ) -> Result<Option<Arc<Session>>, ActError> {
        let Some(session) = self.registry.live(id) else {
            return self.load(id, flow).await;
        };
        match self.ask(&session, false).await {
            Step::Commit(_) | Step::GoOn(_) | Step::Conflict(_) => Ok(Some(session)),
            Step::Replaced(record) => self.insert(id, *record, flow).await.map(Some),
            Step::Gone(_) => {
                self.registry.forget(&session);
                Ok(None)
            }
            Step::Unavailable(unavailable) => Err(unavailable.into()),
        }
    }

    /// Loads the session of this id from the store into memory.
    async fn load(&self, id: Uuid, flow: Flow) -> Result<Option<Arc<Session>>, ActError> {
        let Some(store) = &self.store else {
            return Ok(None);
        };
        match store.load(id).await? {
            Some(record) => self.insert(id, record, flow).await.map(Some),
            None => Ok(None),
        }
    }

    /// Takes the session of a record into memory.
    async fn insert(&self, id: Uuid, record: Record, flow: Flow) -> Result<Arc<Session>, ActError> {
        let (service, queue) = (self.clone(), self.admission.enter(flow, Box::new(()))?);
        let read = move |_: &mut WorkMeter| {
            let state = service.read_state(&record, None)?;
            Ok::<_, ActError>((state, record))
        };
        let (state, record) = self.run(queue, read).await?;
        if let Some(session) = self.registry.live(id)
            && session.name().incarnation != record.opening.incarnation
        {
            self.registry.forget(&session);
        }
        let new = NewSession {
            id,
            opening: record.opening,
            owner: record.owner,
            version: Some(record.version),
            ttl: record.ttl,
            state,
            held: Box::new(()),
        };
        match self.registry.insert(new) {
            Ok(session) => Ok(session),
            // Another request has loaded the session in the meantime, or memory is full.
            Err(_) => {
                let live = self.registry.live(id);
                live.ok_or_else(|| self.registry.full().into())
            }
        }
    }

    /// The state of a record; its trackers reuse what they have in common with `known`, the same session at another
    /// frame. Reading takes long, so it is done on a worker.
    fn read_state(
        &self,
        record: &Record,
        known: Option<&SessionState>,
    ) -> Result<SessionState, ActError> {
        let (max_recent, expert) = (self.settings.max_answers, self.expert.as_ref());
        let state = SessionState::from_stored(&record.state, max_recent, expert, known);
        let state = state.map_err(ActError::StoredState)?;
        // If the state is not that of the checkpoint, the record's frame numbers do not fit it.
        match state.latest_frame() == record.version.checkpoint {
            true => Ok(state),
            false => Err(ActError::StoredState(SnapshotError::Damaged)),
        }
    }

    /// Replaces the session's state and version by those of its record in the store.
    pub(super) async fn take_over(
        &self,
        mut locked: LockedSession,
        record: Record,
        flow: Flow,
    ) -> Result<LockedSession, ActError> {
        let (service, queue) = (self.clone(), self.admission.enter(flow, Box::new(()))?);
        self.run(queue, move |_| {
            let newest = service.read_state(&record, Some(locked.state()))?;
            match PlantedFault::GoesOnWithOldState.is_here() {
                true => locked.session().set_version(Some(record.version)),
                false => locked.replace(newest, Some(record.version)),
            }
            locked.session().set_ttl(record.ttl);
            Ok(locked)
        })
        .await
    }

    /// Ends the session of this id and owner everywhere, and no other one than `only`, where that is given. Work that has
    /// begun still gets its answer. The state is not read, so a session whose state in the store is damaged ends, too.
    ///
    /// # Errors
    /// There is no such session, or the store gives no answer.
    pub async fn end(
        &self,
        id: Uuid,
        owner: &Owner,
        only: Option<SessionName>,
    ) -> Result<(), ActError> {
        // Memory may have an older session of this id, which has ended in the store: the second attempt finds the newer
        // one.
        for _ in 0..2 {
            let name = self.name_of(id, owner).await?;
            if only.is_some_and(|only| only != name) {
                break;
            }
            if self.end_one(name).await? {
                tracing::info!(session = short_id(id), "deleted");
                return Ok(());
            }
        }
        Err(NoSession::Unknown.into())
    }

    /// The name of the session of this id and owner, from memory or from the store.
    async fn name_of(&self, id: Uuid, owner: &Owner) -> Result<SessionName, ActError> {
        let missing = match self.registry.find(id, owner) {
            Ok(session) => return Ok(session.name()),
            Err(missing) => missing,
        };
        let Some(store) = &self.store else {
            return Err(missing.into());
        };
        let record = store.load(id).await?.ok_or(missing)?;
        let incarnation = record.opening.incarnation;
        match record.owner == *owner {
            true => Ok(SessionName { id, incarnation }),
            false => Err(NoSession::Unknown.into()),
        }
    }

    /// Returns false if the session had ended before; another one may have its id.
    async fn end_one(&self, name: SessionName) -> Result<bool, StoreUnavailable> {
        let Some(store) = &self.store else {
            return Ok(self.registry.remove(name));
        };
        let ttl = self.registry.idle_lease().min(TOMBSTONE);
        let has_ended_it = store.end(name, ttl).await?;
        self.registry.remove(name);
        Ok(has_ended_it)
    }
}
