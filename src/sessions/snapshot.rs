//! A session as bytes: the tracker's snapshot and the answers to the last request.
//!
//! Layout: [`MAGIC`], one version byte, the postcard encoding of the content, and the XXH3-64 of all of these (little
//! endian). Snapshots come from clients. The checksum finds accidental damage; the tracker validates its own part.

use super::replay::Answered;
use crate::tracker::{Tracker, TrackerError};
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

/// The first bytes of every session snapshot.
pub const MAGIC: &[u8] = b"\x89bagtrack\r\n";
const VERSION: u8 = 1;
const CHECKSUM_BYTES: usize = 8;

/// Why bytes are not a session.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SnapshotError {
    /// Not a snapshot, or cut short, or changed on the way.
    #[error("it is damaged or cut short")]
    Damaged,
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

#[derive(Serialize, Deserialize)]
struct Content<'a> {
    tracker: &'a [u8],
    recent: Vec<Answered>,
}

impl SessionSnapshot {
    /// The bytes of a session.
    pub(super) fn encode(tracker: &Tracker, recent: &[Answered]) -> Vec<u8> {
        let content = Content {
            tracker: &tracker.snapshot(),
            recent: recent.to_vec(),
        };
        let mut bytes = MAGIC.to_vec();
        bytes.push(VERSION);
        let mut bytes =
            postcard::to_extend(&content, bytes).expect("plain data is always encodable");
        bytes.extend_from_slice(&xxh3_64(&bytes).to_le_bytes());
        bytes
    }

    /// The session of `bytes`.
    ///
    /// # Errors
    /// See [`SnapshotError`].
    pub(super) fn decode(bytes: &[u8]) -> Result<Self, SnapshotError> {
        let body = bytes.strip_prefix(MAGIC).ok_or(SnapshotError::Damaged)?;
        let (&version, body) = body.split_first().ok_or(SnapshotError::Damaged)?;
        if version != VERSION {
            return Err(SnapshotError::Version(version));
        }
        let (content, checksum) = body
            .split_last_chunk::<CHECKSUM_BYTES>()
            .ok_or(SnapshotError::Damaged)?;
        let summed = &bytes[..bytes.len() - CHECKSUM_BYTES];
        if xxh3_64(summed).to_le_bytes() != *checksum {
            return Err(SnapshotError::Damaged);
        }
        let content: Content = postcard::from_bytes(content).map_err(|_| SnapshotError::Damaged)?;
        let tracker = Tracker::restore(content.tracker)?;
        let last = content.recent.last().ok_or(SnapshotError::Damaged)?;
        if last.estimate != tracker.estimate() {
            return Err(SnapshotError::Damaged);
        }
        Ok(Self {
            tracker,
            recent: content.recent,
        })
    }
}
