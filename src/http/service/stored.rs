//! Sessions that are in the store: finding them, going on from their records, ending them.

use super::state::AppState;
use super::work;
use crate::http::problems::problem::Problem;
use crate::http::quotas::client::Client;
use crate::sessions::{
    LockedSession, NewSession, NoSession, Owner, Record, Reply, Session, SessionBusy, SessionState,
    StoreAway,
};
use std::sync::Arc;
use std::time::Duration;
use uuid::Uuid;

/// A session without a record has expired if it had so little time left: answers and clocks are not exact.
const LATE: Duration = Duration::from_secs(1);

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
    let (Some(store), Some(version)) = (&state.store, session.version()) else {
        return Ok(Some(session));
    };
    match store
        .calls
        .check(session.name(), version, false, None)
        .await
    {
        Ok(Reply::Done(_)) => Ok(Some(session)),
        Ok(Reply::Other(record)) if is_of(&record, &session) => Ok(Some(session)),
        Ok(Reply::Other(record)) => insert(state, id, *record, client).await.map(Some),
        Ok(Reply::Missing | Reply::Ended) => {
            state.registry.forget(&session);
            Ok(None)
        }
        Err(away) => Err(away.into()),
    }
}

/// Whether a record is that of this session. Another one may have had its id before, or have it by now.
fn is_of(record: &Record, session: &Session) -> bool {
    record.opening.birth == session.opening().birth
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
    match store.calls.load(id).await? {
        Some(record) => insert(state, id, record, client).await.map(Some),
        None => Ok(None),
    }
}

/// The session of a record, which is then in memory.
async fn insert(
    state: &AppState,
    id: Uuid,
    record: Record,
    client: &Client,
) -> Result<Arc<Session>, Problem> {
    let (opened, record) = decode(state, record, client).await?;
    if let Some(session) = state.registry.live(id)
        && !is_of(&record, &session)
    {
        state.registry.forget(&session);
    }
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
        Ok(session) => Ok(session),
        // Another request has loaded it in the meantime.
        Err(error) => state.registry.live(id).ok_or_else(|| error.into()),
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
    if !is_of(&record, &session) {
        // The next request finds the new one.
        state.registry.forget(&session);
        return Err(SessionBusy.into());
    }
    let (newest, record) = decode(state, record, client).await?;
    locked.replace(newest, Some(record.version));
    session.set_lives(record.lives);
    Ok(())
}

/// The store has no record of a session: its time is over, or the store has lost it.
pub fn missing(state: &AppState, session: &Arc<Session>) -> Problem {
    state.registry.forget(session);
    match session.lives() > LATE {
        true => Problem::session_lost(),
        false => NoSession::Expired.into(),
    }
}

/// The session was ended at another replica.
pub fn ended(state: &AppState, session: &Arc<Session>) -> Problem {
    state.registry.forget(session);
    NoSession::Unknown.into()
}

/// Ends a session everywhere. False where it had ended before: another one may have its id.
///
/// # Errors
/// The store gives no answer.
pub async fn end(state: &AppState, session: &Arc<Session>) -> Result<bool, StoreAway> {
    if let Some(store) = &state.store {
        let lives = state.registry.idle_lease();
        if !store.calls.end(session.name(), lives).await? {
            state.registry.forget(session);
            return Ok(false);
        }
    }
    Ok(state.registry.remove(session.id()))
}
