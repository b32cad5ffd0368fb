//! Orders concurrent requests of one session by frame number.
//!
//! A frame that comes a little early waits for those before it. With a store they may come to other replicas, so the
//! store is asked where the session stands. Without numbers nothing tells the order, so a request is refused that comes
//! while another one is at the session.

use super::error::FramesError;
use super::service::SessionService;
use crate::clock;
use crate::{QueuePermit, SessionBusy, SessionPermit};
use std::time::Duration;

/// How long an early frame waits for its turn.
const PATIENCE: Duration = Duration::from_secs(2);
/// How long until the store is asked first, and the longest time between two questions; each takes twice as long.
const FIRST_PAUSE: Duration = Duration::from_millis(20);
const LONGEST_PAUSE: Duration = Duration::from_millis(320);

impl SessionService {
    /// Waits for the turn of a request whose (first) frame has this number. Meanwhile another request may have its
    /// place in the queue.
    ///
    /// # Errors
    /// It has no number, and another request with frames was at the session when it came; or it is early, and has the
    /// last place at the session; or the session has ended, the store gives no answer, or the queue is full after the
    /// wait.
    pub async fn wait_for_turn(
        &self,
        permit: &SessionPermit,
        queue: QueuePermit,
        number: Option<u64>,
    ) -> Result<QueuePermit, FramesError> {
        let Some(number) = number else {
            return match permit.overlaps() {
                true => Err(FramesError::NotInOrder),
                false => Ok(queue),
            };
        };
        if !permit.is_early(number) {
            return Ok(queue);
        }
        if !permit.may_wait() {
            return Err(SessionBusy.into());
        }
        let flow = queue.flow();
        let request = queue.yield_place();
        if self.store.is_none() {
            permit.wait_for_turn(number, PATIENCE).await;
            return Ok(self.admission.rejoin(request)?);
        }
        let (deadline, mut pause) = (clock::now() + PATIENCE, FIRST_PAUSE);
        while permit.is_early(number) && clock::now() < deadline {
            self.refresh(permit.session(), Some(permit), flow).await?;
            permit.wait_for_turn(number, pause).await;
            pause = LONGEST_PAUSE.min(2 * pause);
        }
        Ok(self.admission.rejoin(request)?)
    }
}
