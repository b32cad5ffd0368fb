//! In which order the requests of a session are taken that come over several connections.
//!
//! Numbers tell the order: a frame that comes a little early waits for those before it. With a store they may come to
//! other replicas, so it asks the store where the session stands. Without numbers nothing tells the order, so a request
//! is refused that comes while another one is at the session.

use super::newest;
use super::state::AppState;
use crate::http::problems::problem::Problem;
use crate::http::quotas::client::Client;
use crate::sessions::{QueuePermit, SessionPermit};
use std::time::Duration;
use tokio::time::Instant;

/// How long an early frame waits for its turn.
const PATIENCE: Duration = Duration::from_secs(2);
/// How often the store is asked meanwhile.
const ASKS_STORE: Duration = Duration::from_millis(20);

/// Waits for the turn of a request whose (first) frame has this number. Meanwhile another request may have its place in
/// the queue.
///
/// # Errors
/// It has no number, and another request with frames was at the session when it came; or the session has ended, the
/// store gives no answer, or the queue is full after the wait.
pub async fn wait_for_turn(
    state: &AppState,
    permit: &SessionPermit,
    client: &Client,
    queue: QueuePermit,
    number: Option<u64>,
) -> Result<QueuePermit, Problem> {
    let Some(number) = number else {
        return match permit.overlaps() {
            true => Err(Problem::not_in_order()),
            false => Ok(queue),
        };
    };
    if !permit.is_early(number) {
        return Ok(queue);
    }
    let request = queue.leave();
    if state.store.is_none() {
        permit.wait_for_turn(number, PATIENCE).await;
        return Ok(state.admission.enter_again(request)?);
    }
    let deadline = Instant::now() + PATIENCE;
    while permit.is_early(number) && Instant::now() < deadline {
        newest::catch_up(state, permit, client).await?;
        permit.wait_for_turn(number, ASKS_STORE).await;
    }
    Ok(state.admission.enter_again(request)?)
}
