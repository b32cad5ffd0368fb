//! Writes the states of sessions to the store, outside of requests.

use super::state::AppState;
use crate::sessions::{LockedSession, Reply, Session, StoreAway};

/// Writes the states of all sessions whose last frames have no checkpoint.
pub async fn flush(state: &AppState) {
    for session in state.registry.all() {
        let is_behind = |session: &Session| {
            let checkpoint = session.checkpoint();
            checkpoint.is_some_and(|checkpoint| checkpoint < session.latest_frame())
        };
        if is_behind(&session)
            && let Ok(permit) = session.visit()
            && let Ok(mut locked) = permit.lock().await
            && is_behind(&session)
        {
            let name = session.short_id();
            match save(state, &mut locked).await {
                Ok(Some(Reply::Done(_)) | None) => {}
                Ok(_) => tracing::debug!(session = name, "another replica has it"),
                Err(error) => tracing::error!(%error, session = name, "not written"),
            }
        }
    }
}

/// Writes a session's state as it is, where there is a store.
async fn save(state: &AppState, locked: &mut LockedSession) -> Result<Option<Reply>, StoreAway> {
    let session = locked.session().clone();
    let (Some(store), Some(before)) = (&state.store, session.version()) else {
        return Ok(None);
    };
    let (current, lives) = (locked.state().clone(), session.lives());
    let (bytes, frame) = (current.stored(), current.latest_frame());
    let written = store
        .calls
        .advance(session.name(), before, frame, Some(&bytes), false, lives);
    let reply = written.await?;
    if let Reply::Done(_) = reply {
        locked.replace(current, Some(before.written(frame)));
    }
    Ok(Some(reply))
}
