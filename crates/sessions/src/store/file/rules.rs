//! What each call does to the database, inside of a transaction.

use super::super::record::{Record, SessionName, UnreadableRecord, Version};
use super::super::session_store::{Commit, Outcome, milliseconds};
use super::database::{ENTRY_BYTES, Transaction, moment};
use super::row::{Row, with_frame};
use fjall::Readable;
use std::time::Duration;
use uuid::Uuid;

/// The note of the store's secret.
const SECRET: &str = "secret";
/// The moment until which notes hold.
const NEVER: u64 = u64::MAX;

/// Why a call did nothing.
#[derive(Debug, thiserror::Error)]
pub(super) enum Fault {
    /// The database could not be read.
    #[error("the files cannot be read: {0}")]
    Database(#[from] fjall::Error),
    /// The record could not be read.
    #[error(transparent)]
    Record(#[from] UnreadableRecord),
}

impl Fault {
    /// Whether what was read is damaged, rather than out of reach or of another version's format.
    fn is_damage(&self) -> bool {
        match self {
            Self::Database(fjall::Error::Io(_))
            | Self::Database(fjall::Error::Storage(fjall::LsmError::Io(_)))
            | Self::Record(UnreadableRecord::Format { .. }) => false,
            Self::Database(_) | Self::Record(UnreadableRecord::Damaged) => true,
        }
    }
}

/// The key of the mark that a session was ended.
fn ended_key(name: SessionName) -> [u8; 24] {
    let mut key = [0; 24];
    key[..16].copy_from_slice(name.id.as_bytes());
    key[16..].copy_from_slice(&name.incarnation.to_be_bytes());
    key
}

impl Transaction<'_> {
    fn expiry(&self, ttl: Duration) -> u64 {
        self.now.saturating_add(milliseconds(ttl))
    }

    /// The row of this id, if its time is not over. A damaged row is dropped.
    fn row(&mut self, id: Uuid) -> Result<Option<Row>, Fault> {
        let bytes = self.inner.get(&self.database.tables.rows, id.as_bytes());
        let row = bytes
            .map_err(Fault::from)
            .and_then(|bytes| Ok(bytes.map(|bytes| Row::from_bytes(&bytes)).transpose()?));
        let row = self.unless_damaged(id, row)?;
        Ok(row.filter(|row| row.expires > self.now))
    }

    /// Those of `names` that have no record any more.
    pub(super) fn gone(&mut self, names: &[SessionName]) -> Result<Vec<SessionName>, Fault> {
        let mut gone = Vec::new();
        for name in names {
            let row = self.row(name.id)?;
            if row.is_none_or(|row| row.incarnation != name.incarnation) {
                gone.push(*name);
            }
        }
        Ok(gone)
    }

    /// Returns what was read of a session. If that is damaged, drops the session and returns `None`.
    fn unless_damaged<T>(
        &mut self,
        id: Uuid,
        read: Result<Option<T>, Fault>,
    ) -> Result<Option<T>, Fault> {
        match read {
            Err(fault) if fault.is_damage() => {
                let session = crate::short_id(id);
                tracing::error!(session, reason = %fault, "a session in the store is damaged, and lost");
                self.drop_session(id);
                Ok(None)
            }
            read => read,
        }
    }

    fn put(&mut self, id: Uuid, row: &Row) {
        let bytes = row.to_bytes();
        self.written.bytes += bytes.len() as u64;
        self.inner
            .insert(&self.database.tables.rows, *id.as_bytes(), bytes);
    }

    /// Writes the state of a session, after the number of its frame.
    fn put_state(&mut self, id: Uuid, frame: u64, state: &[u8]) {
        let bytes = with_frame(frame, state);
        self.written.bytes += bytes.len() as u64;
        self.inner
            .insert(&self.database.tables.states, *id.as_bytes(), bytes);
    }

    fn drop_session(&mut self, id: Uuid) {
        self.inner
            .remove(&self.database.tables.rows, *id.as_bytes());
        self.inner
            .remove(&self.database.tables.states, *id.as_bytes());
    }

    fn has_ended(&self, name: SessionName) -> Result<bool, Fault> {
        let ended = self
            .inner
            .get(&self.database.tables.ended, ended_key(name))?;
        let until = ended.and_then(|bytes| moment(&bytes));
        Ok(until.is_some_and(|until| until > self.now))
    }

    fn absent(&self, name: SessionName) -> Result<Outcome, Fault> {
        Ok(match self.has_ended(name)? {
            true => Outcome::Tombstoned,
            false => Outcome::NotFound,
        })
    }

    /// The record of a row; none if it is damaged.
    fn record(&mut self, id: Uuid, row: &Row) -> Result<Option<Record>, Fault> {
        let read = self.read_record(id, row);
        self.unless_damaged(id, read.map(Some))
    }

    fn read_record(&self, id: Uuid, row: &Row) -> Result<Record, Fault> {
        let state = self
            .inner
            .get(&self.database.tables.states, id.as_bytes())?;
        Ok(row.record(state.as_deref(), self.now)?)
    }

    /// The conflict with a record of another version, at its checkpoint. With `takes_over` the replica that asks goes
    /// on from there; where frames came after the checkpoint, this begins the next generation.
    fn tell(&mut self, id: Uuid, row: Row, takes_over: bool) -> Result<Outcome, Fault> {
        let mut row = row;
        let goes_back = takes_over && row.is_behind();
        if goes_back {
            row.take_over();
        }
        let Some(record) = self.record(id, &row)? else {
            return Ok(Outcome::NotFound);
        };
        if goes_back {
            self.put(id, &row);
            self.written.promises = true;
        }
        Ok(Outcome::Conflict(Box::new(record)))
    }

    fn time_left(&self, row: &Row) -> Duration {
        Duration::from_millis(row.expires.saturating_sub(self.now))
    }

    pub(super) fn create(&mut self, id: Uuid, record: &Record) -> Result<Outcome, Fault> {
        if let Some(row) = self.row(id)? {
            return self.tell(id, row, false);
        }
        let incarnation = record.opening.incarnation;
        if self.has_ended(SessionName { id, incarnation })? {
            return Ok(Outcome::Tombstoned);
        }
        if self.database.is_nearly_full() {
            return Ok(Outcome::Full);
        }
        self.put(id, &Row::of(record, self.expiry(record.ttl)));
        self.put_state(id, record.version.frame, &record.state);
        self.written.promises = true;
        Ok(Outcome::Committed(record.ttl))
    }

    pub(super) fn load(&mut self, id: Uuid) -> Result<Option<Record>, Fault> {
        match self.row(id)? {
            Some(row) => self.record(id, &row),
            None => Ok(None),
        }
    }

    pub(super) fn commit(&mut self, commit: &Commit) -> Result<Outcome, Fault> {
        let id = commit.name.id;
        let Some(mut row) = self.row(id)? else {
            return self.absent(commit.name);
        };
        if !row.is_at(commit.before) {
            return self.tell(id, row, commit.takes_over);
        }
        row.version = row.version.committed(commit.frame, commit.state.is_some());
        row.expires = self.expiry(commit.ttl);
        if let Some(state) = &commit.state {
            row.state_bytes = state.len() as u64;
            self.put_state(id, commit.frame, state);
        }
        self.put(id, &row);
        self.written.promises = true;
        Ok(Outcome::Committed(commit.ttl))
    }

    pub(super) fn check(
        &mut self,
        name: SessionName,
        version: Version,
        takes_over: bool,
        renew: Option<Duration>,
    ) -> Result<Outcome, Fault> {
        let Some(mut row) = self.row(name.id)? else {
            return self.absent(name);
        };
        if let Some(ttl) = renew {
            row.expires = self.expiry(ttl);
            self.put(name.id, &row);
        }
        match row.is_at(version) {
            true => Ok(Outcome::Committed(self.time_left(&row))),
            false => self.tell(name.id, row, takes_over),
        }
    }

    pub(super) fn fence(&mut self, name: SessionName, version: Version) -> Result<Outcome, Fault> {
        let Some(mut row) = self.row(name.id)? else {
            return self.absent(name);
        };
        if !row.is_at(version) {
            return self.tell(name.id, row, true);
        }
        row.version = row.version.fenced();
        self.put(name.id, &row);
        self.written.promises = true;
        Ok(Outcome::Committed(self.time_left(&row)))
    }

    pub(super) fn end(&mut self, name: SessionName, ttl: Duration) -> Result<bool, Fault> {
        // A row that cannot be read goes, too: whoever ends a session wants it gone.
        let row = match self.row(name.id) {
            Err(Fault::Record(_)) => None,
            row => row?,
        };
        let is_own = row.as_ref().map(|row| row.incarnation == name.incarnation);
        let is_here = match is_own {
            Some(is_own) => is_own,
            None => !self.has_ended(name)?,
        };
        if is_own != Some(false) {
            self.written.dropped_bytes += row.map_or(0, |row| row.state_bytes);
            self.drop_session(name.id);
        }
        let until = self.expiry(ttl).to_be_bytes();
        self.written.bytes += ENTRY_BYTES;
        self.inner
            .insert(&self.database.tables.ended, ended_key(name), until);
        self.written.promises = true;
        Ok(is_here)
    }

    pub(super) fn secret(&mut self, new: [u8; 32]) -> Result<[u8; 32], Fault> {
        if let Some(secret) = self.note(SECRET)? {
            return Ok(secret);
        }
        self.put_note(SECRET, &new);
        Ok(new)
    }

    /// The store's note of this name, where there is one of `N` bytes.
    pub(super) fn note<const N: usize>(&self, name: &str) -> fjall::Result<Option<[u8; N]>> {
        let note = self.inner.get(&self.database.tables.notes, name)?;
        Ok(note.and_then(|bytes| bytes.get(8..)?.try_into().ok()))
    }

    pub(super) fn put_note(&mut self, name: &str, value: &[u8]) {
        let bytes = [&NEVER.to_be_bytes(), value].concat();
        self.written.bytes += bytes.len() as u64;
        self.inner
            .insert(&self.database.tables.notes, name.as_bytes(), bytes);
        self.written.promises = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::file::database::Database;
    use fjall::PersistMode;

    /// If marks were not counted as written, their journal would stay however long it is.
    #[test]
    fn marks_of_ended_sessions_count_as_written_and_are_dropped_in_parts() {
        let folder = tempfile::tempdir().unwrap();
        let mut database = Database::open(folder.path()).unwrap();
        let mut transaction = database.begin(1);
        let ttl = Duration::from_millis(9);
        for incarnation in 0..1500 {
            let id = Uuid::from_u128(incarnation.into());
            let name = SessionName { id, incarnation };
            assert!(transaction.end(name, ttl).unwrap());
        }
        let written = transaction.write(PersistMode::Buffer).unwrap();
        assert!(written.bytes > 1500 * 32);
        assert!(!database.sweep(9).unwrap(), "their time is not over");
        assert!(database.sweep(10).unwrap(), "there are more");
        assert!(!database.sweep(10).unwrap());
        let name = SessionName {
            id: Uuid::from_u128(1499),
            incarnation: 1499,
        };
        assert!(!database.begin(9).has_ended(name).unwrap());
    }
}
