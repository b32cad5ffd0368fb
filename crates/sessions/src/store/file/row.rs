//! The rows of the database: sessions' records without their states.

use super::super::record::{Record, UnreadableRecord, Version};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The format of a row. Rows of another format are not read.
const FORMAT: u8 = 1;

/// A row: all of a record but its state, which is written less often.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Row {
    pub(super) version: Version,
    pub(super) incarnation: u64,
    /// When the time to live is over, in milliseconds of the folder's time.
    pub(super) expires: u64,
    /// Bytes of the state.
    pub(super) state_bytes: u64,
    /// See [`Record::head`].
    head: Vec<u8>,
}

impl Row {
    /// The row of a new record.
    pub(super) fn of(record: &Record, expires: u64) -> Self {
        Self {
            version: record.version,
            incarnation: record.opening.incarnation,
            expires,
            state_bytes: record.state.len() as u64,
            head: record.head(),
        }
    }

    /// Whether this is the record's newest version.
    pub(super) fn is_at(&self, version: Version) -> bool {
        let own = self.version;
        (own.generation, own.frame) == (version.generation, version.frame)
    }

    /// The row as bytes: a format number, then the content in postcard's encoding.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        postcard::to_extend(self, vec![FORMAT]).expect("plain data is always encodable")
    }

    /// Reads what [`Self::to_bytes`] wrote.
    ///
    /// # Errors
    /// The row is damaged, or has another format.
    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Self, UnreadableRecord> {
        match bytes.split_first() {
            Some((&FORMAT, content)) => {
                let row: Self =
                    postcard::from_bytes(content).map_err(|_| UnreadableRecord::Damaged)?;
                match Version::is_generation(row.version.generation) {
                    true => Ok(row),
                    false => Err(UnreadableRecord::Damaged),
                }
            }
            Some((&found, _)) => Err(UnreadableRecord::Format {
                found,
                read: FORMAT,
            }),
            None => Err(UnreadableRecord::Damaged),
        }
    }

    /// Whether there are frames after the checkpoint.
    pub(super) fn is_behind(&self) -> bool {
        self.version.frame != self.version.checkpoint
    }

    /// The next generation begins at the checkpoint: a replica goes on from there.
    pub(super) fn take_over(&mut self) {
        self.version = self.version.fenced();
        self.version.frame = self.version.checkpoint;
    }

    /// The record at its checkpoint. `state` is the entry of the table of states, as [`with_frame`] makes it; `now` is
    /// in milliseconds of the folder's time.
    ///
    /// # Errors
    /// The head cannot be read, or the state is missing or of another frame than the checkpoint, as damaged files may
    /// have it.
    pub(super) fn record(
        &self,
        state: Option<&[u8]>,
        now: u64,
    ) -> Result<Record, UnreadableRecord> {
        let state = state.and_then(<[u8]>::split_first_chunk);
        let (frame, state) = state.ok_or(UnreadableRecord::Damaged)?;
        let Version {
            generation,
            checkpoint,
            ..
        } = self.version;
        if u64::from_be_bytes(*frame) != checkpoint {
            return Err(UnreadableRecord::Damaged);
        }
        let ttl = Duration::from_millis(self.expires.saturating_sub(now));
        Record::at_checkpoint(generation, checkpoint, &self.head, state.to_vec(), ttl)
    }
}

/// The entries of a record in the tables of rows and of states: inputs that fuzzing begins with.
#[cfg(fuzzing)]
pub fn row_and_state(record: &Record) -> (Vec<u8>, Vec<u8>) {
    let row = Row::of(record, u64::MAX / 2).to_bytes();
    (row, with_frame(record.version.frame, &record.state))
}

/// Reads the entries of a record in the tables of rows and of states, as for a replica that takes the record over.
/// Fuzzing calls this, so that it needs no folder.
///
/// # Errors
/// See [`UnreadableRecord`].
#[cfg(fuzzing)]
pub fn record_of_row(row: &[u8], state: &[u8]) -> Result<Record, UnreadableRecord> {
    let mut row = Row::from_bytes(row)?;
    row.take_over();
    row.record(Some(state), 0)
}

/// The entry of a state in its table: the number of its frame as 8 bytes, big-endian, then the state.
pub(super) fn with_frame(frame: u64, state: &[u8]) -> Vec<u8> {
    [&frame.to_be_bytes(), state].concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::record::tests::record;

    /// Taking over a row of the greatest generation would panic in the store's thread.
    #[test]
    fn a_row_whose_generation_cannot_be_counted_up_is_damaged() {
        let record = record(11, 3);
        let mut row = Row::of(&record, 9);
        assert_eq!(Row::from_bytes(&row.to_bytes()), Ok(row.clone()));
        let state = with_frame(3, &record.state);
        assert_eq!(row.record(Some(&state), 0).unwrap().state, record.state);
        let of_other_frame = with_frame(2, &record.state);
        for state in [Some(&of_other_frame[..]), Some(&[1, 2]), None] {
            assert_eq!(row.record(state, 0), Err(UnreadableRecord::Damaged));
        }
        row.version.generation = u64::MAX;
        assert_eq!(
            Row::from_bytes(&row.to_bytes()),
            Err(UnreadableRecord::Damaged)
        );
    }
}
