//! Writes the states of sessions to the store, outside of requests.

use super::service::SessionService;
use crate::store::{Commit, Outcome, StoreUnavailable};
use crate::{LockedSession, Session};

impl SessionService {
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

    /// Writes a session's state as it is. False where the store has another version.
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
            state: Some(&bytes),
            takes_over: false,
            // What is left by this clock may be nothing after a jump, and the store would drop the record.
            ttl: self.registry.idle_lease(),
        };
        let is_written = matches!(store.commit(commit).await?, Outcome::Committed(_));
        if is_written {
            session.set_version(Some(before.committed(frame, true)));
        }
        Ok(is_written)
    }
}
