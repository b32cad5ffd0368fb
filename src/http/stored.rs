//! Sessions that are in the store: finding them, going on from their records, ending them.

use super::client::Client;
use super::problems::problem::Problem;
use super::state::AppState;
use super::store_config::SharedStore;
use super::work;
use crate::sessions::{
    LockedSession, NewSession, NoSession, Owner, Record, Reply, Session, SessionBusy, SessionState,
    StoreAway,
};
use std::sync::Arc;
use uuid::Uuid;

/// The live session of this id and owner, from memory or from the store.
///
/// # Errors
/// There is none, or the store gives no answer.
pub async fn find(
    state: &AppState,
    id: Uuid,
    owner: &Owner,
    client: &Client,
) -> Result<Arc<Session>, Problem> {
    let missing = match state.registry.find(id, owner) {
        Ok(session) => return Ok(session),
        Err(missing) => missing,
    };
    let session = load(state, id, client).await?.ok_or(missing)?;
    match session.owner() == owner {
        true => Ok(session),
        false => Err(NoSession::Unknown.into()),
    }
}

/// The live session of this id, whoever it belongs to, if it is still in the store.
///
/// # Errors
/// The store gives no answer.
pub async fn live(
    state: &AppState,
    id: Uuid,
    client: &Client,
) -> Result<Option<Arc<Session>>, Problem> {
    let Some(session) = state.registry.live(id) else {
        return load(state, id, client).await;
    };
    match (&state.store, session.version()) {
        (Some(store), Some(version)) => match store.calls.check(id, version, false, None).await {
            Ok(Reply::Gone) => {
                state.registry.remove(id);
                Ok(None)
            }
            Ok(_) => Ok(Some(session)),
            Err(_) if store.best_effort => Ok(Some(session)),
            Err(away) => Err(away.into()),
        },
        _ => Ok(Some(session)),
    }
}

/// The session of this id from the store, which is then in memory too.
async fn load(
    state: &AppState,
    id: Uuid,
    client: &Client,
) -> Result<Option<Arc<Session>>, Problem> {
    let Some(store) = &state.store else {
        return Ok(None);
    };
    let record = match store.calls.load(id).await {
        Ok(Some(record)) => record,
        Err(away) if !store.best_effort => return Err(away.into()),
        Ok(None) | Err(_) => return Ok(None),
    };
    let (opened, record) = decode(state, record, client).await?;
    let new = NewSession {
        id,
        opening: record.opening,
        owner: record.owner,
        version: Some(record.version),
        lives: record.lives,
        state: opened,
        held: Box::new(()),
    };
    match state.registry.insert(new) {
        Ok(session) => Ok(Some(session)),
        // Another request has loaded it in the meantime.
        Err(error) => match state.registry.live(id) {
            Some(session) => Ok(Some(session)),
            None => Err(error.into()),
        },
    }
}

/// Reads a record's state on a worker.
async fn decode(
    state: &AppState,
    record: Record,
    client: &Client,
) -> Result<(SessionState, Record), Problem> {
    let lane = state.clients.account(client).lane();
    let queue = state.admission.enter(lane, Box::new(()))?;
    let max_recent = state.config.max_frames;
    work::run(state, queue, move |_| {
        let opened = SessionState::from_stored(&record.state, max_recent);
        let opened = opened.map_err(|error| Problem::internal(Arc::new(error)))?;
        Ok((opened, record))
    })
    .await
}

/// Goes on from a record of the store.
///
/// # Errors
/// The record is another session's, which has the same id, or it cannot be read.
pub async fn take_over(
    state: &AppState,
    locked: &mut LockedSession,
    record: Record,
    client: &Client,
) -> Result<(), Problem> {
    let session = locked.session().clone();
    if record.opening.birth != session.opening().birth {
        // The next request finds the new one.
        state.registry.remove(session.id());
        return Err(SessionBusy.into());
    }
    let (newest, record) = decode(state, record, client).await?;
    locked.replace(newest, Some(record.version));
    session.set_lives(record.lives);
    Ok(())
}

/// The session is no longer in the store.
pub fn gone(state: &AppState, session: &Session) -> Problem {
    state.registry.remove(session.id());
    NoSession::Unknown.into()
}

/// Ends a session everywhere. Whether it was there.
///
/// # Errors
/// The store gives no answer.
pub async fn remove(state: &AppState, session: &Session) -> Result<bool, StoreAway> {
    if let Some(store) = &state.store {
        store.calls.remove(session.id()).await?;
    }
    Ok(state.registry.remove(session.id()))
}

/// Writes the states of all sessions whose last frames are in memory only.
pub async fn flush(state: &AppState) {
    let Some(store) = &state.store else { return };
    for session in state.registry.all() {
        let is_behind = |session: &Session| {
            let checkpoint = session.version().map(|version| version.checkpoint);
            checkpoint.is_some_and(|checkpoint| checkpoint < session.latest_frame())
        };
        if is_behind(&session)
            && let Ok(permit) = session.visit()
            && let Ok(mut locked) = permit.lock().await
            && is_behind(&session)
        {
            write(store, &mut locked).await;
        }
    }
}

/// Writes a session's state as it is.
async fn write(store: &SharedStore, locked: &mut LockedSession) {
    let session = locked.session().clone();
    let (current, lives) = (locked.state().clone(), session.lives());
    let (Some(before), frame) = (session.version(), current.latest_frame()) else {
        return;
    };
    let bytes = current.stored();
    let written = store
        .calls
        .advance(session.id(), before, frame, Some(&bytes), lives);
    match written.await {
        Ok(Reply::Done(_)) => locked.replace(current, Some(before.written(frame))),
        Ok(_) => tracing::debug!(session = session.short_id(), "another replica has it"),
        Err(error) => tracing::error!(%error, session = session.short_id(), "not written"),
    }
}
