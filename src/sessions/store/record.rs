//! What the store holds of a session.

use crate::sessions::opening::Opening;
use crate::sessions::owner::Owner;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use uuid::Uuid;

/// Names a session. The id alone may be another session's later.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SessionName {
    /// Its id.
    pub id: Uuid,
    /// The random number that it was opened with.
    pub birth: u64,
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
            generation: rand::random::<u64>() >> 2,
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

    /// After the state of this frame was written.
    pub fn written(self, frame: u64) -> Self {
        Self {
            frame,
            checkpoint: frame,
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
    pub lives: Duration,
}

/// The part of a record that never changes.
#[derive(Serialize, Deserialize)]
struct Head {
    owner: Option<String>,
    opening: Opening,
}

/// A record's fields as the scripts tell them: generation, checkpoint, head, state.
pub(super) type Fields = (u64, u64, Vec<u8>, Vec<u8>);

impl Record {
    /// The head as bytes.
    pub(super) fn head(owner: &Owner, opening: &Opening) -> Vec<u8> {
        let head = Head {
            owner: owner.name().map(str::to_owned),
            opening: opening.clone(),
        };
        postcard::to_stdvec(&head).expect("plain data is always encodable")
    }

    /// The record of these fields; none if another version of the program wrote the head.
    pub(super) fn read(fields: Fields, lives: Duration) -> Option<Self> {
        let (generation, checkpoint, head, state) = fields;
        let Head { owner, opening } = postcard::from_bytes(&head).ok()?;
        Some(Self {
            version: Version {
                generation,
                // Frames after it are not in the state: whoever goes on from here has to take the record over.
                frame: checkpoint,
                checkpoint,
            },
            owner: owner.map_or_else(Owner::default, |name| Owner::named(&name)),
            opening,
            state,
            lives,
        })
    }
}
