//! What the store holds of a session.

use crate::opening::Opening;
use crate::owner::Owner;
use crate::planted::PlantedFault;
use crate::random::random;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use uuid::Uuid;

/// The format of [`Record::head`]. Another one is not read; see [`UnreadableRecord`].
const HEAD_FORMAT: u8 = 2;

/// Names a session. The id alone may be another session's later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SessionName {
    /// Its id.
    pub id: Uuid,
    /// The random number that it was opened with.
    pub incarnation: u64,
}

/// Which state of a record a replica has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Version {
    /// Goes up when a replica takes over a record whose last frames it does not have, or opens a stream.
    pub generation: u64,
    /// The last frame that was answered.
    pub frame: u64,
    /// The last frame whose state was written.
    pub checkpoint: u64,
}

impl Version {
    /// A new record's, at this frame. No other record has had its generation: what was tracked from another one, also of
    /// the same session, does not go on from this.
    pub fn first(frame: u64) -> Self {
        Self {
            // Below 2⁶², so that it can be counted up as a signed number.
            generation: random::<u64>() >> 2,
            frame,
            checkpoint: frame,
        }
    }

    /// After the next generation has begun.
    pub fn fenced(self) -> Self {
        Self {
            generation: self.generation + 1,
            ..self
        }
    }

    /// After this frame was committed, with its state or without.
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
    /// Whose the session is.
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
    /// Another version wrote it: replicas of that version, which run meanwhile, can read it.
    #[error("the record has format {found}, and this service reads {read}")]
    Format {
        /// That of the record.
        found: u8,
        /// The one that this version reads.
        read: u8,
    },
    /// It is damaged.
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
        Ok(Self {
            version: Version {
                generation,
                frame: checkpoint,
                checkpoint,
            },
            owner: owner.map_or_else(Owner::default, |name| Owner::named(&name)),
            opening,
            state,
            ttl,
        })
    }
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
        // Before records had a format they began with whether there is an owner.
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
}
