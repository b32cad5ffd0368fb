//! Opens sessions: one for each name (idempotency key or id), so that a request that is sent again gets the same
//! answer.

use super::error::OpenError;
use super::idempotency::{CreationKey, id_of};
use super::service::SessionService;
use super::start::Start;
use crate::clock::timeout;
use crate::random::{new_id, random};
use crate::store::{Counted, Outcome, Record, SessionName, StoreShare, Version};
use crate::{
    ActError, NewSession, Owner, QueuePermit, Reservation, Session, SessionState, Stopped,
    WorkMeter,
};
use std::fmt::Debug;
use std::sync::Arc;
use uuid::Uuid;

/// How many sessions a client may have.
pub trait SessionQuota: Debug + Send + Sync {
    /// Whether the client may have one more session.
    ///
    /// # Errors
    /// The client has as many as it may.
    fn check(&self) -> Result<(), OpenError>;

    /// Counts a session with `targets` targets and a state of `bytes` bytes, until the returned reservation is dropped.
    ///
    /// # Errors
    /// The client, or the service, has not so many left.
    fn reserve(&self, targets: usize, bytes: usize) -> Result<Reservation, OpenError>;

    /// What the client may have in a store that replicas share.
    fn store_share(&self) -> StoreShare;
}

/// A request to open a session.
#[derive(Debug)]
pub struct OpenRequest {
    /// The idempotency key or the id that the client gives, if any.
    pub key: Option<CreationKey>,
    /// The session's owner.
    pub owner: Owner,
    /// A digest of what the session begins with. Two requests of one name are the same request if their digests are
    /// equal.
    pub digest: [u8; 32],
    /// What the session begins with.
    pub start: Start,
    /// How many sessions the client may have.
    pub quota: Arc<dyn SessionQuota>,
    /// The place in the queue.
    pub queue: QueuePermit,
}

/// An open session.
#[derive(Debug)]
pub struct Opened {
    /// The session.
    pub session: Arc<Session>,
    /// Whether it was opened by the same request before.
    pub replayed: bool,
}

impl SessionService {
    /// Opens a session, or finds the one that the same request opened before.
    ///
    /// # Errors
    /// The frame, the boxes, the parameters or the snapshot cannot be used, there is no room, or another request has
    /// opened a session under this name.
    pub async fn open(&self, request: OpenRequest) -> Result<Opened, OpenError> {
        let Some(key) = request.key.clone() else {
            let session = self.open_as(request, new_id()).await?;
            return Ok(Opened {
                session,
                replayed: false,
            });
        };
        let entry = self
            .opened
            .entry(key.clone(), |id| self.registry.is_live(id));
        // Another request of this name may be about to open the session.
        let locked = timeout(self.settings.work_timeout, entry.lock_owned());
        let mut opened = locked.await.map_err(|_| Stopped::Deadline)?;
        let id = match &key {
            CreationKey::Id(id) => *id,
            CreationKey::Key(owner, key) => self.id_of_key(owner, key, *opened).await?,
        };
        let (flow, owner, digest) = (request.queue.flow(), request.owner.clone(), request.digest);
        if let Some(session) = self.find_authoritative(id, flow).await? {
            check_same(&session, &owner, digest, &key)?;
            return Ok(Opened {
                session,
                replayed: true,
            });
        }
        self.check_room(&*request.quota)?;
        match self.open_as(request, id).await {
            // Another replica was first.
            Err(OpenError::Exists) => {
                let session = self.find_authoritative(id, flow).await?;
                let session = session.ok_or(OpenError::Exists)?;
                check_same(&session, &owner, digest, &key)?;
                Ok(Opened {
                    session,
                    replayed: true,
                })
            }
            session => {
                let session = session?;
                *opened = Some(session.id());
                Ok(Opened {
                    session,
                    replayed: false,
                })
            }
        }
    }

    /// Refuses new sessions where there is no room for them, or when the service is about to end.
    ///
    /// # Errors
    /// There is no room here, the client has as many as it may, or the service is about to end.
    pub fn check_room(&self, quota: &dyn SessionQuota) -> Result<(), OpenError> {
        if self.is_draining() {
            return Err(OpenError::Draining);
        }
        self.registry.check_room()?;
        quota.check()
    }

    /// The id of the session that an idempotency key names: that of the live session, or a new id. With a store the id
    /// is computed from the key, so all replicas find the same one, and a request that opens nothing stores nothing.
    async fn id_of_key(
        &self,
        owner: &Owner,
        key: &str,
        opened: Option<Uuid>,
    ) -> Result<Uuid, ActError> {
        if let Some(live) = opened.filter(|id| self.registry.is_live(*id)) {
            return Ok(live);
        }
        match &self.store {
            None => Ok(new_id()),
            Some(store) => Ok(id_of(&store.secret(random()).await?, owner, key)),
        }
    }

    async fn open_as(&self, request: OpenRequest, id: Uuid) -> Result<Arc<Session>, OpenError> {
        let OpenRequest {
            owner,
            digest,
            start,
            quota,
            queue,
            ..
        } = request;
        let queue = queue.for_frames(start.target_count());
        let (service, queue) = (self.clone(), queue.for_size(0, start.file_bytes()));
        let begin = move |meter: &mut WorkMeter| {
            let state = start.run(&service, meter)?;
            let bytes = service.store.is_some().then(|| state.stored());
            Ok((state, bytes))
        };
        let (state, bytes): (SessionState, _) = self.run::<_, OpenError, _>(queue, begin).await?;
        let held = quota.reserve(state.target_count(), state.session_bytes())?;
        let opening = self.registry.opening(digest, &state);
        let ttl = self.registry.first_lease();
        let mut version = None;
        if let (Some(store), Some(bytes)) = (&self.store, bytes) {
            let record = Record {
                version: Version::first(state.latest_frame()),
                owner: owner.clone(),
                opening: opening.clone(),
                state: bytes,
                ttl,
            };
            let share = quota.store_share();
            let counted = Counted {
                name: SessionName {
                    id,
                    incarnation: opening.incarnation,
                },
                places: state.target_count(),
                bytes: state.session_bytes(),
                ttl,
            };
            if !store.admit(&share, counted).await? {
                return Err(OpenError::StoreShare(share));
            }
            match store.create(id, &record).await? {
                Outcome::Committed(_) => version = Some(record.version),
                Outcome::Full => return Err(self.registry.full().into()),
                _ => return Err(OpenError::Exists),
            }
        }
        let new = NewSession {
            id,
            opening,
            owner,
            version,
            ttl,
            state,
            held,
        };
        let session = self.registry.insert(new)?;
        tracing::info!(session = session.short_id(), "opened");
        Ok(session)
    }
}

/// Refuses a request whose name another request has used.
fn check_same(
    session: &Session,
    owner: &Owner,
    digest: [u8; 32],
    key: &CreationKey,
) -> Result<(), OpenError> {
    let is_same = session.owner() == owner && session.opening().request == digest;
    match (is_same, key) {
        (true, _) => Ok(()),
        (false, CreationKey::Id(_)) => Err(OpenError::Exists),
        (false, CreationKey::Key(..)) => Err(OpenError::KeyReused),
    }
}
