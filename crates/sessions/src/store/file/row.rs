//! What the database has of a session beside its state.

use super::super::record::{Record, UnreadableRecord, Version};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The format of a row. Another one is not read.
const FORMAT: u8 = 1;

/// A row: all of a record but its state, which is written less often.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Row {
    pub(super) generation: u64,
    /// The last frame that was answered.
    pub(super) frame: u64,
    /// The last frame whose state was written.
    pub(super) checkpoint: u64,
    pub(super) incarnation: u64,
    /// When the time to live is over, in milliseconds since 1970.
    pub(super) expires: u64,
    /// Of the state.
    pub(super) state_bytes: u64,
    /// See [`Record::head`].
    head: Vec<u8>,
}

impl Row {
    /// Of a new record.
    pub(super) fn of(record: &Record, expires: u64) -> Self {
        let Version {
            generation,
            frame,
            checkpoint,
        } = record.version;
        Self {
            generation,
            frame,
            checkpoint,
            incarnation: record.opening.incarnation,
            expires,
            state_bytes: record.state.len() as u64,
            head: record.head(),
        }
    }

    /// Whether this is the record's newest version.
    pub(super) fn is_at(&self, version: Version) -> bool {
        (self.generation, self.frame) == (version.generation, version.frame)
    }

    /// A format number, then the content in postcard's encoding.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        postcard::to_extend(self, vec![FORMAT]).expect("plain data is always encodable")
    }

    /// Reads what [`Self::to_bytes`] wrote.
    ///
    /// # Errors
    /// It is damaged, or has another format.
    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Self, UnreadableRecord> {
        match bytes.split_first() {
            Some((&FORMAT, content)) => {
                postcard::from_bytes(content).map_err(|_| UnreadableRecord::Damaged)
            }
            Some((&found, _)) => Err(UnreadableRecord::Format {
                found,
                read: FORMAT,
            }),
            None => Err(UnreadableRecord::Damaged),
        }
    }

    /// The record at its checkpoint.
    ///
    /// # Errors
    /// Its head cannot be read.
    pub(super) fn record(&self, state: Vec<u8>, now: u64) -> Result<Record, UnreadableRecord> {
        let ttl = Duration::from_millis(self.expires.saturating_sub(now));
        Record::at_checkpoint(self.generation, self.checkpoint, &self.head, state, ttl)
    }
}
