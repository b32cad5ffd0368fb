//! In which order the requests of a session are taken that come over several connections.
//!
//! Numbers tell the order: a frame that comes a little early waits for those before it. Without numbers nothing tells
//! it, so a request is refused that comes while another one is at the session.

use super::problems::problem::Problem;
use crate::sessions::SessionPermit;
use std::time::Duration;

/// How long an early frame waits for its turn.
const PATIENCE: Duration = Duration::from_secs(2);

/// Waits for the turn of a request whose (first) frame has this number.
///
/// # Errors
/// It has no number, and another request with frames was at the session when it came.
pub async fn wait_for_turn(permit: &SessionPermit, number: Option<u64>) -> Result<(), Problem> {
    match number {
        Some(number) => permit.wait_for_turn(number, PATIENCE).await,
        None if permit.overlaps() => return Err(Problem::not_in_order()),
        None => {}
    }
    Ok(())
}
