//! What a session is made of.

use super::opening::Opening;
use super::owner::Owner;
use super::scheduler::queue_permit::Reservation;
use super::state::SessionState;
use super::store::Version;
use std::time::Duration;
use uuid::Uuid;

/// What a session is made of.
pub struct NewSession {
    /// Its id: the client's own, or a random one.
    pub id: Uuid,
    /// How it was opened.
    pub opening: Opening,
    /// Whose it is.
    pub owner: Owner,
    /// Which version of the record in the store this is, where there is one.
    pub version: Option<Version>,
    /// It expires after this time without a frame.
    pub ttl: Duration,
    /// The trackers and the last answers.
    pub state: SessionState,
    /// What is kept until the session is freed.
    pub held: Reservation,
}
