//! What the store holds of a session.

use crate::planted::PlantedFault;
use crate::random::random;
use crate::session::{Opening, Owner};
use crate::targets::{MAX_TARGETS, PerTarget};
use serde::{Deserialize, Serialize};
use std::time::Duration;
use uuid::Uuid;

/// The format of [`Record::head`]. A record of another format is refused with [`UnreadableRecord::Format`].
const HEAD_FORMAT: u8 = 2;
/// The greatest generation that is read: stores count it up as a signed number.
const MAX_GENERATION: u64 = i64::MAX as u64 - 1;
/// The last second of the year 9999, in seconds since 1970. Later moments cannot be written as RFC 3339.
const LAST_MOMENT: u64 = 253_402_300_799;
/// No session lives longer without a frame: a hundred years, so that the moment of its end can be written.
pub(super) const MAX_TTL: Duration = Duration::from_secs(100 * 366 * 24 * 3600);

/// The unique name of a session. The id alone is not unique: after a session has ended, another one may be opened under
/// its id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SessionName {
    /// Its id.
    pub id: Uuid,
    /// The random number that it was opened with.
    pub incarnation: u64,
}

/// Which version of a record a replica's copy of the session goes on from. The store in a folder writes this type as it
/// is, so the fields are part of its format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Version {
    /// Goes up when a replica takes over a record whose last frames it does not have, or opens a stream.
    pub generation: u64,
    /// The last frame that was answered.
    pub frame: u64,
    /// The last frame whose state was written.
    pub checkpoint: u64,
}

impl Version {
    /// The version of a new record at this frame. Its generation is random, so that no copy of an earlier record, not
    /// even of the same session, counts as this version.
    pub fn first(frame: u64) -> Self {
        Self {
            // Below 2⁶², so that it can be counted up as a signed number.
            generation: random::<u64>() >> 2,
            frame,
            checkpoint: frame,
        }
    }

    /// Whether a generation can be counted up. A damaged record may hold any number.
    pub(super) fn is_generation(number: u64) -> bool {
        number <= MAX_GENERATION
    }

    /// This version after the next generation has begun.
    pub fn fenced(self) -> Self {
        Self {
            generation: self.generation + 1,
            ..self
        }
    }

    /// This version after a frame was committed, with its state or without.
    pub fn committed(self, frame: u64, with_state: bool) -> Self {
        Self {
            frame,
            checkpoint: if with_state { frame } else { self.checkpoint },
            ..self
        }
    }
}

/// What the store holds of a session.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Which state this is.
    pub version: Version,
    /// The client that owns the session.
    pub owner: Owner,
    /// How it was opened.
    pub opening: Opening,
    /// The state at the checkpoint, as bytes.
    pub state: Vec<u8>,
    /// After this time without a frame the record is gone.
    pub ttl: Duration,
}

/// The part of a record that never changes.
#[derive(Serialize, Deserialize)]
struct Head {
    owner: Option<String>,
    opening: Opening,
}

/// A record that this version of the program cannot read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum UnreadableRecord {
    /// Another version of the program wrote the record. Replicas of that version, which may run during an upgrade, can
    /// read it.
    #[error("the record has format {found}, and this service reads {read}")]
    Format {
        /// The record's format.
        found: u8,
        /// The format that this version reads.
        read: u8,
    },
    /// The record is damaged.
    #[error("the record is damaged")]
    Damaged,
}

impl Record {
    /// The part that never changes, as bytes: a format number, then the content in postcard's encoding.
    pub fn head(&self) -> Vec<u8> {
        let head = Head {
            owner: self.owner.name().map(str::to_owned),
            opening: self.opening.clone(),
        };
        let format = match PlantedFault::ForgetsFormat.is_here() {
            true => Vec::new(),
            false => vec![HEAD_FORMAT],
        };
        postcard::to_extend(&head, format).expect("plain data is always encodable")
    }

    /// The record at its checkpoint. Frames after it are not in the state, so whoever goes on from here has to take the
    /// record over.
    ///
    /// # Errors
    /// See [`UnreadableRecord`].
    pub fn at_checkpoint(
        generation: u64,
        checkpoint: u64,
        head: &[u8],
        state: Vec<u8>,
        ttl: Duration,
    ) -> Result<Self, UnreadableRecord> {
        let Head { owner, opening } = match head.split_first() {
            Some((&HEAD_FORMAT, content)) => {
                postcard::from_bytes(content).map_err(|_| UnreadableRecord::Damaged)?
            }
            Some((&found, _)) => {
                let read = HEAD_FORMAT;
                return Err(UnreadableRecord::Format { found, read });
            }
            None => return Err(UnreadableRecord::Damaged),
        };
        if !Version::is_generation(generation) || !can_be_told(&opening) {
            return Err(UnreadableRecord::Damaged);
        }
        Ok(Self {
            version: Version {
                generation,
                frame: checkpoint,
                checkpoint,
            },
            owner: owner.map_or_else(Owner::default, |name| Owner::named(&name)),
            opening,
            state,
            ttl: ttl.min(MAX_TTL),
        })
    }
}

/// Whether a request that opens the session again can be answered: the number of targets is possible, and the moment of
/// expiry can be written.
fn can_be_told(opening: &Opening) -> bool {
    let has_targets = match &opening.estimates {
        PerTarget::One(_) => true,
        PerTarget::List(list) => (1..=MAX_TARGETS).contains(&list.len()),
    };
    has_targets && opening.expires <= LAST_MOMENT
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::targets::Estimates;
    use bagtrack_tracker::{Estimate, Rect, Status};

    /// A record of a session that was opened at frame 0, at this frame.
    pub(crate) fn record(incarnation: u64, frame: u64) -> Record {
        let estimate = Estimate {
            frame: 0,
            target: Rect::new(1.0, 2.0, 30.0, 40.0),
            score: 1.0,
            status: Status::Tracking,
        };
        Record {
            version: Version::first(frame),
            owner: Owner::named("ann"),
            opening: Opening {
                request: [7; 32],
                estimates: Estimates::One(estimate),
                expires: 9,
                incarnation,
            },
            state: vec![1, 2, 3],
            ttl: Duration::from_secs(60),
        }
    }

    #[test]
    fn a_record_is_read_again_and_one_of_another_format_says_so() {
        let written = record(11, 0);
        let version = written.version;
        let read = |head: &[u8]| {
            let (state, ttl) = (written.state.clone(), written.ttl);
            Record::at_checkpoint(version.generation, version.checkpoint, head, state, ttl)
        };
        let head = written.head();
        assert_eq!(read(&head), Ok(written.clone()));
        // A head without the format begins with 1 where there is an owner.
        let format = |found| UnreadableRecord::Format {
            found,
            read: HEAD_FORMAT,
        };
        assert_eq!(read(&head[1..]), Err(format(1)));
        let newer = [&[HEAD_FORMAT + 1], &head[1..]].concat();
        assert_eq!(read(&newer), Err(format(HEAD_FORMAT + 1)));
        let cut = &head[..head.len() - 3];
        assert_eq!(read(cut), Err(UnreadableRecord::Damaged));
        assert_eq!(read(&[]), Err(UnreadableRecord::Damaged));
    }

    /// If such a head were read, the request that opens the session again would panic.
    #[test]
    fn a_record_whose_opening_cannot_be_told_is_damaged() {
        let read = |generation, change: fn(&mut Record)| {
            let mut record = record(11, 0);
            change(&mut record);
            let (head, ttl) = (record.head(), record.ttl);
            Record::at_checkpoint(generation, 0, &head, record.state, ttl).map(|read| read.ttl)
        };
        let damaged = Err(UnreadableRecord::Damaged);
        assert_eq!(read(7, |_| ()), Ok(Duration::from_secs(60)));
        let no_target = |record: &mut Record| record.opening.estimates = PerTarget::List(vec![]);
        assert_eq!(read(7, no_target), damaged);
        let too_many = |record: &mut Record| {
            let first = *record.opening.estimates.first();
            record.opening.estimates = PerTarget::List(vec![first; MAX_TARGETS + 1]);
        };
        assert_eq!(read(7, too_many), damaged);
        let never = |record: &mut Record| record.opening.expires = u64::MAX;
        assert_eq!(read(7, never), damaged);
        // The greatest generation cannot be counted up.
        assert_eq!(read(u64::MAX, |_| ()), damaged);
        let long = |record: &mut Record| record.ttl = Duration::from_millis(u64::MAX);
        assert_eq!(read(7, long), Ok(MAX_TTL));
    }
}
