//! A session as bytes: the trackers' snapshots and the answers to the last frames.
//!
//! Layout: [`MAGIC`], one version byte, the compressed content, and the code of all of these under a key of the service
//! ([`MacKeys`]). The content is, in postcard's encoding: the trackers' snapshots, then the list of stored answers,
//! each with the frame's digest and the answer for each target. Where the session was opened with a list of boxes, the
//! version is [`LIST_VERSION`], and the number of targets comes first. Snapshots come from clients, so nothing in them
//! is read before the code is checked. A service may accept unsigned snapshots, so all in them is bounded and checked
//! nevertheless: no more of the stored answers are kept than a session stores, and the tracker validates its own part.
//!
//! A snapshot of a tracker alone counts as a session's too. It comes from a tracker in a page or a program, which has
//! no key, so it is accepted where unsigned snapshots are.

use super::compression;
use super::mac::{MAC_BYTES, MacKeys};
use super::replay::{Answered, Fingerprint, TargetAnswer};
use super::state::SessionState;
use super::targets::{MAX_TARGETS, PerTarget, Targets};
use bagtrack_tracker::{Expert, SNAPSHOT_MAGIC as TRACKER_MAGIC, Tracker, TrackerError};
use postcard::take_from_bytes;
use serde::Serialize;
use serde::de::Deserialize;
use std::collections::VecDeque;
use std::sync::Arc;

/// The first bytes of every session snapshot.
pub const MAGIC: &[u8] = b"\x89bagtrack\r\n";
/// The use for which keys of snapshots are derived (see [`MacKeys::new`]).
pub const KEY_CONTEXT: &str = "bagtrack 2026-11 session snapshot";
/// Format version of a session that was opened with a box.
const VERSION: u8 = 4;
/// Format version of a session that was opened with a list of boxes.
const LIST_VERSION: u8 = 5;

/// Why bytes are not a session.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SnapshotError {
    /// Not a snapshot, or cut short, or one whose parts do not fit each other.
    #[error("it is damaged or cut short")]
    Damaged,
    /// Changed on the way, or signed with a key that this service does not have.
    #[error("it was changed, or signed by a service with other keys (BAGTRACK_SNAPSHOT_KEYS)")]
    NotAuthentic,
    /// A snapshot of a tracker alone, where unsigned snapshots are not accepted.
    #[error("it is not signed, and this service takes signed ones alone (--unsigned-snapshots)")]
    Unsigned,
    /// Written by another version of the program.
    #[error("it has format version {0}, and this service reads {VERSION} and {LIST_VERSION}")]
    Version(u8),
    /// The tracker does not accept its part.
    #[error(transparent)]
    Tracker(#[from] TrackerError),
}

/// Whether bytes begin as a snapshot of a session or of a tracker does.
pub fn is_snapshot(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC) || bytes.starts_with(TRACKER_MAGIC)
}

impl SessionState {
    /// The session as bytes, signed.
    pub fn snapshot(&self, keys: &MacKeys) -> Vec<u8> {
        let mut bytes = self.stored();
        let code = keys.sign(&bytes);
        bytes.extend_from_slice(&code);
        bytes
    }

    /// The session that a snapshot holds, with the last `max_recent` of its stored answers. A tracker with a second
    /// opinion goes on with `expert`, that of this process.
    ///
    /// # Errors
    /// See [`SnapshotError`].
    pub fn restore(
        snapshot: &[u8],
        keys: &MacKeys,
        max_recent: usize,
        expert: Option<&Arc<dyn Expert>>,
    ) -> Result<Self, SnapshotError> {
        if snapshot.starts_with(TRACKER_MAGIC) {
            return Self::of_tracker(snapshot, keys, expert);
        }
        check_version(snapshot)?;
        let (content, code) = snapshot
            .split_last_chunk::<MAC_BYTES>()
            .ok_or(SnapshotError::Damaged)?;
        if !keys.verify(content, code) {
            return Err(SnapshotError::NotAuthentic);
        }
        Self::from_stored(content, max_recent, expert, None)
    }

    /// A session from the snapshot of a tracker alone. The bytes of its last frame are unknown, so the digest of the
    /// snapshot stands in for theirs.
    fn of_tracker(
        bytes: &[u8],
        keys: &MacKeys,
        expert: Option<&Arc<dyn Expert>>,
    ) -> Result<Self, SnapshotError> {
        if !keys.accept_unsigned() {
            return Err(SnapshotError::Unsigned);
        }
        let trackers = PerTarget::One(Tracker::restore_beside(bytes, expert.cloned())?);
        let targets = Targets::restored(trackers).ok_or(SnapshotError::Damaged)?;
        let answers = targets.estimates().map(|&estimate| TargetAnswer {
            given: None,
            estimate,
        });
        let recent = vec![Answered {
            fingerprint: Fingerprint::of(bytes),
            targets: answers,
        }];
        Ok(Self { targets, recent })
    }

    /// The session as bytes for the store, which are not signed.
    pub fn stored(&self) -> Vec<u8> {
        let trackers = self.targets.trackers();
        let (version, count) = match trackers {
            PerTarget::One(_) => (VERSION, Vec::new()),
            PerTarget::List(list) => (LIST_VERSION, extend(Vec::new(), &list.len())),
        };
        let mut answers = extend(Vec::new(), &self.recent.len());
        for Answered {
            fingerprint,
            targets,
        } in &self.recent
        {
            answers = extend(answers, fingerprint);
            answers = targets.as_slice().iter().fold(answers, extend);
        }
        let mut parts = vec![count];
        for tracker in trackers.as_slice() {
            let snapshot = tracker.snapshot();
            parts.extend([extend(Vec::new(), &snapshot.len()), snapshot]);
        }
        parts.push(answers);
        let content = parts.concat();
        let mut bytes = [MAGIC, &[version]].concat();
        compression::compress(&content, &mut bytes);
        bytes
    }

    /// The session that [`Self::stored`] wrote. Trackers reuse what they have in common with `known`, the same session
    /// at another frame.
    ///
    /// # Errors
    /// See [`SnapshotError`].
    pub fn from_stored(
        bytes: &[u8],
        max_recent: usize,
        expert: Option<&Arc<dyn Expert>>,
        known: Option<&Self>,
    ) -> Result<Self, SnapshotError> {
        let (version, compressed) = check_version(bytes)?;
        let content = compression::decompress(compressed).ok_or(SnapshotError::Damaged)?;
        let mut rest = &content[..];
        let mut count = None;
        if version == LIST_VERSION {
            let number;
            (number, rest) = take::<usize>(rest)?;
            if !(1..=MAX_TARGETS).contains(&number) {
                return Err(SnapshotError::Damaged);
            }
            count = Some(number);
        }
        let mut known = known
            .map_or(&[][..], |known| known.targets.trackers().as_slice())
            .iter();
        let trackers = per_target(count, || {
            let tracker;
            (tracker, rest) = take::<&[u8]>(rest)?;
            Ok(match known.next() {
                Some(known) => known.restore_near(tracker, expert.cloned())?,
                None => Tracker::restore_beside(tracker, expert.cloned())?,
            })
        })?;
        let targets = Targets::restored(trackers).ok_or(SnapshotError::Damaged)?;
        let recent = recent(rest, count, max_recent)?;
        let last = recent.last().ok_or(SnapshotError::Damaged)?;
        match last.estimates() == targets.estimates() {
            true => Ok(Self { targets, recent }),
            false => Err(SnapshotError::Damaged),
        }
    }
}

/// Splits bytes into the format version and what follows it.
fn check_version(bytes: &[u8]) -> Result<(u8, &[u8]), SnapshotError> {
    let body = bytes.strip_prefix(MAGIC).ok_or(SnapshotError::Damaged)?;
    let (&version, body) = body.split_first().ok_or(SnapshotError::Damaged)?;
    match version {
        VERSION | LIST_VERSION => Ok((version, body)),
        _ => Err(SnapshotError::Version(version)),
    }
}

/// One value of `next`, or a list of `count` of them.
fn per_target<T>(
    count: Option<usize>,
    mut next: impl FnMut() -> Result<T, SnapshotError>,
) -> Result<PerTarget<T>, SnapshotError> {
    Ok(match count {
        None => PerTarget::One(next()?),
        Some(count) => PerTarget::List((0..count).map(|_| next()).collect::<Result<_, _>>()?),
    })
}

/// The last `max` stored answers of a list that takes all of `bytes`. No more than `max` are in memory at a time.
fn recent(
    bytes: &[u8],
    targets: Option<usize>,
    max: usize,
) -> Result<Vec<Answered>, SnapshotError> {
    let (count, mut rest) = take::<usize>(bytes)?;
    let mut recent: VecDeque<Answered> = VecDeque::new();
    for _ in 0..count {
        let fingerprint;
        (fingerprint, rest) = take::<Fingerprint>(rest)?;
        let targets = per_target(targets, || {
            let target;
            (target, rest) = take::<TargetAnswer>(rest)?;
            Ok(target)
        })?;
        let answered = Answered {
            fingerprint,
            targets,
        };
        let frame = answered.frame();
        let of_frame = |target: &TargetAnswer| target.estimate.frame == frame;
        let follows = |before: &Answered| before.frame().checked_add(1) == Some(frame);
        if !answered.targets.as_slice().iter().all(of_frame) || !recent.back().is_none_or(follows) {
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

fn extend<T: Serialize>(bytes: Vec<u8>, value: &T) -> Vec<u8> {
    postcard::to_extend(value, bytes).expect("plain data is always encodable")
}

fn take<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<(T, &'a [u8]), SnapshotError> {
    take_from_bytes(bytes).map_err(|_| SnapshotError::Damaged)
}
