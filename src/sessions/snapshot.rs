//! A session as bytes: the tracker's snapshot and the answers to the last request.
//!
//! Layout: [`MAGIC`], one version byte, the postcard encoding of [`Content`], and the code of all of these under a key
//! of the service ([`MacKeys`]). Snapshots come from clients, so nothing in them is read before the code is checked. A
//! service may accept unsigned ones, so all in them is bounded and checked nevertheless: of the stored answers only as
//! many are kept as a request may have, and the tracker validates its own part.

use super::mac::{MAC_BYTES, MacKeys};
use super::replay::Answered;
use crate::tracker::{Tracker, TrackerError};
use postcard::take_from_bytes;
use serde::Serialize;
use serde::de::Deserialize;
use std::collections::VecDeque;

/// The first bytes of every session snapshot.
pub const MAGIC: &[u8] = b"\x89bagtrack\r\n";
/// What keys for snapshots are derived for.
pub const KEY_CONTEXT: &str = "bagtrack 2026-11 session snapshot";
const VERSION: u8 = 2;

/// Why bytes are not a session.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SnapshotError {
    /// Not a snapshot, or cut short, or one whose parts do not fit each other.
    #[error("it is damaged or cut short")]
    Damaged,
    /// Changed on the way, or signed with a key that this service does not have.
    #[error("it was changed, or signed by a service with other keys (BAGTRACK_SNAPSHOT_KEYS)")]
    NotAuthentic,
    /// Written by another version of the program.
    #[error("it has format version {0}, and this service reads version {VERSION}")]
    Version(u8),
    /// The tracker does not accept its part.
    #[error(transparent)]
    Tracker(#[from] TrackerError),
}

/// What a snapshot holds.
#[derive(Debug)]
pub(super) struct SessionSnapshot {
    pub(super) tracker: Tracker,
    /// The answers to the last request, oldest first; at least one.
    pub(super) recent: Vec<Answered>,
}

#[derive(Serialize)]
struct Content<'a> {
    tracker: &'a [u8],
    recent: &'a [Answered],
}

impl SessionSnapshot {
    /// The bytes of a session.
    pub(super) fn encode(tracker: &Tracker, recent: &[Answered], keys: &MacKeys) -> Vec<u8> {
        let content = Content {
            tracker: &tracker.snapshot(),
            recent,
        };
        let mut bytes = MAGIC.to_vec();
        bytes.push(VERSION);
        let mut bytes =
            postcard::to_extend(&content, bytes).expect("plain data is always encodable");
        let code = keys.sign(&bytes);
        bytes.extend_from_slice(&code);
        bytes
    }

    /// The session of `bytes`, with the last `max_recent` of its stored answers.
    ///
    /// # Errors
    /// See [`SnapshotError`].
    pub(super) fn decode(
        bytes: &[u8],
        keys: &MacKeys,
        max_recent: usize,
    ) -> Result<Self, SnapshotError> {
        let body = bytes.strip_prefix(MAGIC).ok_or(SnapshotError::Damaged)?;
        let (&version, body) = body.split_first().ok_or(SnapshotError::Damaged)?;
        if version != VERSION {
            return Err(SnapshotError::Version(version));
        }
        let (content, code) = body
            .split_last_chunk::<MAC_BYTES>()
            .ok_or(SnapshotError::Damaged)?;
        if !keys.verify(&bytes[..bytes.len() - MAC_BYTES], code) {
            return Err(SnapshotError::NotAuthentic);
        }
        let (tracker, rest) = take::<&[u8]>(content)?;
        let recent = recent(rest, max_recent)?;
        let tracker = Tracker::restore(tracker)?;
        let last = recent.last().ok_or(SnapshotError::Damaged)?;
        if last.estimate != tracker.estimate() {
            return Err(SnapshotError::Damaged);
        }
        Ok(Self { tracker, recent })
    }
}

/// The last `max` stored answers of a list that takes all of `bytes`. Only those are ever held.
fn recent(bytes: &[u8], max: usize) -> Result<Vec<Answered>, SnapshotError> {
    let (count, mut rest) = take::<usize>(bytes)?;
    let mut recent: VecDeque<Answered> = VecDeque::new();
    for _ in 0..count {
        let answered;
        (answered, rest) = take::<Answered>(rest)?;
        if let Some(before) = recent.back()
            && before.estimate.frame.checked_add(1) != Some(answered.estimate.frame)
        {
            return Err(SnapshotError::Damaged);
        }
        if recent.len() >= max {
            recent.pop_front();
        }
        recent.push_back(answered);
    }
    match rest {
        [] => Ok(recent.into()),
        _ => Err(SnapshotError::Damaged),
    }
}

fn take<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<(T, &'a [u8]), SnapshotError> {
    take_from_bytes(bytes).map_err(|_| SnapshotError::Damaged)
}
