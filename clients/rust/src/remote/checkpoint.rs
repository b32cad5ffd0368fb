//! After each answer, makes sure that the session can go on elsewhere: takes snapshots, and leaves a service that is
//! about to end.

use super::Remote;
use crate::transport::{Query, Standing};
use crate::upload::Origin;
use bagtrack_api::CreatedSession;
use bagtrack_api::media_types::SNAPSHOT;
use std::time::Duration;
use tokio::time::Instant;

/// The pause between tries to leave a service that is about to end: it may be the only one for a while.
const MOVE_EVERY: Duration = Duration::from_secs(1);

impl Remote {
    /// Makes sure, after the answer to a frame, that the session can go on elsewhere.
    pub(super) async fn checkpoint(&mut self) {
        let Standing {
            checkpoint,
            draining,
        } = self.standing;
        if let Some(stored) = checkpoint {
            // The store has the session up to this frame: any replica can go on with it.
            self.kept.forget_until(stored);
        } else if draining && self.may_try_to_move() {
            self.move_on().await;
        } else if self.snapshot_every == 0 {
            self.kept.forget_until(self.answered);
        } else {
            let since = |origin: &Origin| self.answered.saturating_sub(origin.frame);
            let origin = self.kept.origin();
            if origin.is_none_or(|origin| since(origin) >= self.snapshot_every) {
                self.renew_origin().await;
            }
        }
    }

    fn may_try_to_move(&self) -> bool {
        let tried = self.tried_to_move;
        tried.is_none_or(|tried| tried.elapsed() >= MOVE_EVERY)
    }

    /// Opens the session at the next address, since the service is about to end. If that fails, stays here.
    async fn move_on(&mut self) {
        self.tried_to_move = Some(Instant::now());
        if !self.renew_origin().await {
            return;
        }
        let Some(origin) = self.kept.origin() else {
            return;
        };
        let request = origin.request(self.transport.carrier.new_id());
        let here = self.transport.used;
        self.transport.next_address();
        let created = match self.transport.attempt(&request).await {
            Ok(reply) if reply.status.is_success() => serde_json::from_slice(&reply.body).ok(),
            _ => None,
        };
        match created {
            Some(CreatedSession { id, frame, .. }) => {
                (self.id, self.last_acknowledged) = (id, frame)
            }
            None => self.transport.used = here,
        }
    }

    /// Takes a snapshot as the new origin, and returns whether it succeeded. Otherwise the older origin stays, with the
    /// frames after it.
    async fn renew_origin(&mut self) -> bool {
        let snapshot = match self.transport.attempt(&self.request_snapshot()).await {
            Ok(reply) if reply.status.is_success() => reply.snapshot().ok(),
            _ => None,
        };
        let is_taken = snapshot.is_some();
        if let Some(body) = snapshot {
            self.kept.renew(Origin {
                frame: self.answered,
                query: Query::new(),
                media_type: SNAPSHOT,
                body,
            });
        }
        is_taken
    }
}
