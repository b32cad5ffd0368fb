//! What is done after each answer, so that the session can go on elsewhere: snapshots, and leaving a service that is
//! about to end.

use super::Remote;
use crate::transport::{Query, Standing};
use crate::upload::Origin;
use bagtrack_api::CreatedSession;
use bagtrack_api::media_types::SNAPSHOT;
use std::time::Duration;
use tokio::time::Instant;

/// A service that is about to end may be the only one for a while: how long until the next try to go elsewhere.
const MOVE_EVERY: Duration = Duration::from_secs(1);

impl Remote {
    /// Makes sure, after the answer to a frame, that the session can go on elsewhere.
    pub(super) async fn checkpoint(&mut self) {
        let Standing {
            checkpoint,
            draining,
        } = self.standing;
        if let Some(stored) = checkpoint {
            // A store has the session up to there: any replica goes on with it.
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

    /// Goes on elsewhere, since the service is about to end. If there is nothing else yet, it goes on here.
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

    /// Takes a snapshot; without it the older one and more frames are kept.
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
