//! The trait of all stores of sessions, with the types of its calls and answers.

use super::record::{Record, SessionName, Version};
use bytes::Bytes;
use futures_util::future::BoxFuture;
use std::fmt::Debug;
use std::time::Duration;
use uuid::Uuid;

/// The store gave no answer in time, or could not do the call; the text is the reason. Without an answer the store may
/// have done the call nevertheless.
#[derive(Debug, Clone, Default, thiserror::Error)]
#[error("the store gives no answer: {0}")]
pub struct StoreUnavailable(pub String);

/// What the store says to a call about a record.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The call was done or, for a check, the version is the newest. The record lives for this time without a further
    /// frame.
    Committed(Duration),
    /// The id has a record of another version, or of another session. The call was not done; this is that record at its
    /// checkpoint.
    Conflict(Box<Record>),
    /// The id has no record: its time to live is over, or the store has lost it.
    NotFound,
    /// The session was ended.
    Tombstoned,
    /// The store is nearly full: it takes no further session, so that it can take the frames of those that it has.
    Full,
}

/// A frame that is to be committed.
#[derive(Debug, Clone)]
pub struct Commit {
    /// Which session.
    pub name: SessionName,
    /// The version that the frame was tracked from.
    pub before: Version,
    /// The number of the frame.
    pub frame: u64,
    /// The session's state after the frame; `None` where only the frame's number is committed.
    pub state: Option<Bytes>,
    /// Whether this replica, on a conflict, goes on from the record's checkpoint. Where frames came after the
    /// checkpoint, the store then begins the record's next generation.
    pub takes_over: bool,
    /// How long the record lives from now without a frame.
    pub ttl: Duration,
}

/// What a client may have in the store, at all replicas together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoreShare {
    /// The client's name.
    pub client: String,
    /// Most places of sessions, one for each target.
    pub max_places: usize,
    /// Most bytes of their states.
    pub max_bytes: usize,
}

/// A session that is to be counted against its client's [`StoreShare`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counted {
    /// The session.
    pub name: SessionName,
    /// Places that it takes, one for each target.
    pub places: usize,
    /// Most bytes that its state takes.
    pub bytes: usize,
    /// How long its record lives without a frame.
    pub ttl: Duration,
}

/// The answer to a call.
pub type StoreFuture<'a, T> = BoxFuture<'a, Result<T, StoreUnavailable>>;

/// A store of sessions. Each call is done as a whole or not at all, and ends within a bounded time.
pub trait SessionStore: Debug + Send + Sync {
    /// Adds a record, unless there is one under this id or the session was ended.
    fn create<'a>(&'a self, id: Uuid, record: &'a Record) -> StoreFuture<'a, Outcome>;

    /// Counts a session, which is about to be created, against its client's share. False where the share has no room
    /// for it. A session counts as long as its record lives.
    ///
    /// The default counts nothing: that suffices for a store that ends with its process and has only sessions in
    /// memory.
    fn admit<'a>(&'a self, share: &'a StoreShare, session: Counted) -> StoreFuture<'a, bool> {
        let _ = (share, session);
        Box::pin(async { Ok(true) })
    }

    /// The record of this id at its checkpoint, if there is one.
    fn load(&self, id: Uuid) -> StoreFuture<'_, Option<Record>>;

    /// Moves a record from the version before a frame to that frame.
    fn commit(&self, commit: Commit) -> StoreFuture<'_, Outcome>;

    /// Asks whether this version is the newest. `takes_over` is that of [`Commit`]; `renew`, where given, becomes the
    /// record's time to live.
    fn check(
        &self,
        name: SessionName,
        version: Version,
        takes_over: bool,
        renew: Option<Duration>,
    ) -> StoreFuture<'_, Outcome>;

    /// Begins the next generation of a record, if this version is the newest: no other replica goes on from its own
    /// copy.
    fn fence(&self, name: SessionName, version: Version) -> StoreFuture<'_, Outcome>;

    /// Ends a session, and remembers for `ttl` that it was ended. False where it had ended before.
    fn end(&self, name: SessionName, ttl: Duration) -> StoreFuture<'_, bool>;

    /// A random number that all who use the store have in common and clients do not know: `new`, if there is none yet.
    fn secret(&self, new: [u8; 32]) -> StoreFuture<'_, [u8; 32]>;

    /// Whether the store answers and takes writes. The default is for stores that are never away.
    fn is_ready(&self) -> bool {
        true
    }

    /// Whether it is so full that it takes no further session.
    fn is_full(&self) -> bool {
        false
    }

    /// How many calls got no answer or were refused since the start.
    fn failures(&self) -> u64 {
        0
    }
}

/// A time in whole milliseconds, at least one: the unit of the stores.
pub(super) fn milliseconds(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX).max(1)
}
