//! Writing sessions to the store.
//!
//! A session has no record where it was opened while the store was away (`--store-mode best-effort`), or where the store
//! has lost it. Then one is made, unless there is one by now or the session was ended.

use super::state::AppState;
use super::stored::is_alive;
use crate::http::config::store::SharedStore;
use crate::sessions::{LockedSession, Record, Reply, Session, StoreAway, Version};
use std::time::Duration;

/// A state that is to be written.
#[derive(Debug, Clone, Copy)]
pub struct Written<'a> {
    /// Its frame.
    pub frame: u64,
    /// The state as bytes; without them the record gets the frame's number alone.
    pub bytes: Option<&'a [u8]>,
    /// Whether the store has lost the record of the session.
    pub is_lost: bool,
    /// Whether this replica goes on from the record, where that has another version.
    pub goes_on: bool,
    /// How long the record lives without a frame.
    pub lives: Duration,
}

/// Moves the record of a session on; makes one where there is none. Tells which version the record has if that was done.
///
/// # Errors
/// The store gives no answer.
pub async fn write(
    store: &SharedStore,
    session: &Session,
    Written {
        frame,
        bytes,
        is_lost,
        goes_on,
        lives,
    }: Written<'_>,
) -> Result<(Reply, Version), StoreAway> {
    if let Some(before) = session.version().filter(|_| !is_lost) {
        let advanced = store
            .calls
            .advance(session.name(), before, frame, bytes, goes_on, lives);
        let after = match bytes {
            Some(_) => before.written(frame),
            None => Version { frame, ..before },
        };
        return Ok((advanced.await?, after));
    }
    let record = Record {
        version: Version::first(frame),
        owner: session.owner().clone(),
        opening: session.opening().clone(),
        state: bytes.map(<[u8]>::to_vec).unwrap_or_default(),
        lives,
    };
    let created = store.calls.create(session.id(), &record).await?;
    Ok((created, record.version))
}

/// Writes a session's state as it is.
///
/// # Errors
/// The store gives no answer.
pub async fn save(store: &SharedStore, locked: &mut LockedSession) -> Result<Reply, StoreAway> {
    let session = locked.session().clone();
    let (current, lives) = (locked.state().clone(), session.lives());
    let bytes = current.stored();
    let mut written = Written {
        frame: current.latest_frame(),
        bytes: Some(&bytes),
        is_lost: false,
        goes_on: false,
        lives,
    };
    let (mut reply, mut version) = write(store, &session, written).await?;
    if reply == Reply::Missing && is_alive(&session) {
        written.is_lost = true;
        (reply, version) = write(store, &session, written).await?;
    }
    if let Reply::Done(_) = reply {
        locked.replace(current, Some(version));
    }
    Ok(reply)
}

/// Writes the states of all sessions whose last frames are in memory only.
pub async fn flush(state: &AppState) {
    let Some(store) = &state.store else { return };
    for session in state.registry.all() {
        let is_behind = |session: &Session| {
            let checkpoint = session.version().map(|version| version.checkpoint);
            checkpoint.is_none_or(|checkpoint| checkpoint < session.latest_frame())
        };
        if is_behind(&session)
            && let Ok(permit) = session.visit()
            && let Ok(mut locked) = permit.lock().await
            && is_behind(&session)
        {
            let name = session.short_id();
            match save(store, &mut locked).await {
                Ok(Reply::Done(_)) => {}
                Ok(_) => tracing::debug!(session = name, "another replica has it"),
                Err(error) => tracing::error!(%error, session = name, "not written"),
            }
        }
    }
}
