//! The database in its folder: opened, written in transactions, repaired, swept, and given back to the disk.

use super::folder::{
    check_journals, clear_unfinished, has_tables, journal_paths, journals, make_folder,
};
use super::row::Row;
use super::time::{CLOCK, Noted};
use fjall::{
    Keyspace, KeyspaceCreateOptions, PersistMode, Readable, SingleWriterTxDatabase,
    SingleWriterTxKeyspace, SingleWriterWriteTx,
};
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, sleep};
use std::time::Duration;

/// Most written bytes in memory before they go to sorted tables on the disk.
const MEMTABLE_BYTES: u64 = 16 << 20;
/// Memory for blocks of the tables that were read.
const CACHE_BYTES: u64 = 8 << 20;
/// About the most bytes of all journals; the database takes no smaller bound.
const JOURNAL_BYTES: u64 = 64 << 20;
/// Space is given back once this many bytes of states were dropped.
const COMPACTED_BYTES: u64 = 8 << 20;
/// A new session is refused where less than one part in this many of the disk is free, and less than [`MAX_RESERVE`]
/// bytes. The frames of the sessions in the store need this room, and so do tables while they are rewritten.
const RESERVE: u64 = 10;
const MAX_RESERVE: u64 = 1 << 30;
/// Most rows, and most marks of ended sessions, that are dropped in one transaction.
const SWEPT_ROWS: usize = 1024;
/// About the bytes that an entry without a state takes in memory, with the map's own.
pub(super) const ENTRY_BYTES: u64 = 128;

/// The reason of failed calls where the database was removed, or its disk is gone.
pub(super) const GONE: &str = "the store's files are not there any more";

/// A key that is no session's id, for writes of the store itself.
const NO_SESSION: [u8; 1] = [0];

/// Why a folder cannot be used as a store.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// Another process has the folder.
    #[error("another process uses the store in {0}: give each process a folder of its own")]
    Locked(PathBuf),
    /// The system refused a call.
    #[error("the store in {folder} cannot be opened: {source}")]
    Io {
        /// The folder.
        folder: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The database's files are damaged.
    #[error(
        "the files of the store in {folder} are damaged ({reason}): put a copy of the folder in its place, or move it \
         away to begin without its sessions"
    )]
    Damaged {
        /// The folder.
        folder: PathBuf,
        /// What the database says.
        reason: String,
    },
    /// Another version of the database wrote the folder.
    #[error(
        "the store in {0} was written by another version of this program: start that one, or move the folder away"
    )]
    Version(PathBuf),
}

impl OpenError {
    pub(super) fn io(folder: &Path, source: io::Error) -> Self {
        let folder = folder.to_owned();
        Self::Io { folder, source }
    }

    pub(super) fn of(folder: &Path, error: fjall::Error) -> Self {
        let folder = folder.to_owned();
        match error {
            fjall::Error::Locked => Self::Locked(folder),
            fjall::Error::Io(source) if is_of_system(&source) => Self::Io { folder, source },
            fjall::Error::Storage(fjall::LsmError::Io(source)) if is_of_system(&source) => {
                Self::Io { folder, source }
            }
            fjall::Error::InvalidVersion(Some(_)) => Self::Version(folder),
            other => Self::Damaged {
                folder,
                reason: other.to_string(),
            },
        }
    }
}

/// Whether an error comes from the system. All other errors mean damage: a file has bad content, is missing, should not
/// be there, or is so short that the database seeks to before its beginning (`InvalidInput`).
fn is_of_system(error: &io::Error) -> bool {
    use io::ErrorKind as Kind;
    match error.kind() {
        Kind::NotFound | Kind::AlreadyExists | Kind::InvalidInput => false,
        // Errors while a temporary file is written come without the system's number.
        Kind::StorageFull
        | Kind::QuotaExceeded
        | Kind::FileTooLarge
        | Kind::ReadOnlyFilesystem
        | Kind::PermissionDenied => true,
        _ => error.raw_os_error().is_some(),
    }
}

/// The tables of the database.
pub(super) struct Tables {
    /// Rows by the sessions' ids.
    pub(super) rows: SingleWriterTxKeyspace,
    /// States by the sessions' ids.
    pub(super) states: SingleWriterTxKeyspace,
    /// Marks of ended sessions, by id and incarnation: the moment until which each mark stays.
    pub(super) ended: SingleWriterTxKeyspace,
    /// The store's notes on itself, by name, each with the moment until which it holds. In a folder of v0.1.0 there are
    /// idempotency keys among them.
    pub(super) notes: SingleWriterTxKeyspace,
}

impl Tables {
    fn all(&self) -> [&SingleWriterTxKeyspace; 4] {
        [&self.rows, &self.states, &self.ended, &self.notes]
    }
}

pub(super) struct Database {
    folder: PathBuf,
    /// The thread that gives back space. It has handles of the tables, so it is waited for before they are dropped.
    compaction: Option<JoinHandle<()>>,
    is_closing: Arc<AtomicBool>,
    pub(super) tables: Tables,
    inner: SingleWriterTxDatabase,
    /// Bytes in memory that are not in tables yet.
    written_bytes: u64,
    /// Bytes of states that were dropped and may still take space.
    dropped_bytes: u64,
}

impl Drop for Database {
    fn drop(&mut self) {
        self.is_closing.store(true, Ordering::Release);
        if let Some(compaction) = self.compaction.take() {
            // A thread that panicked has logged its panic.
            let _ = compaction.join();
        }
    }
}

impl Database {
    /// Opens the database in this folder, and makes one where there is none.
    ///
    /// # Errors
    /// See [`OpenError`].
    pub(super) fn open(folder: &Path) -> Result<Self, OpenError> {
        let io = |source| OpenError::io(folder, source);
        make_folder(folder).map_err(io)?;
        let written = journals(folder).map_err(io)?;
        if has_tables(folder).map_err(io)? {
            check_journals(folder, &written)?;
        } else if written.iter().all(|(_, length)| *length == 0) {
            clear_unfinished(folder).map_err(io)?;
        }
        // Damaged files may break an assumption of the database.
        let opened = catch_unwind(AssertUnwindSafe(|| Self::open_unguarded(folder)));
        let opened = opened.map_err(|_| OpenError::Damaged {
            folder: folder.to_owned(),
            reason: "the database could not make sense of them".to_owned(),
        })?;
        let database = opened.map_err(|error| OpenError::of(folder, error))?;
        for (path, length) in written {
            // A journal that is not there any more was read to its end.
            let kept = path.metadata().map_or(length, |metadata| metadata.len());
            if kept < length {
                tracing::warn!(
                    bytes = length - kept,
                    journal = %path.display(),
                    "the end of the store's journal was cut off while it was written, or is damaged, and was left out; \
                     the sessions in it go on from before"
                );
            }
        }
        Ok(database)
    }

    /// Opens the database of a folder that has one. A folder without one may be that of a disk which is not there. A
    /// new database would then tell clients that their sessions are lost.
    ///
    /// # Errors
    /// See [`OpenError`].
    pub(super) fn open_again(folder: &Path) -> Result<Self, OpenError> {
        let error = |source| OpenError::io(folder, source);
        if journals(folder).map_err(error)?.is_empty() {
            return Err(error(io::Error::new(io::ErrorKind::NotFound, GONE)));
        }
        Self::open(folder)
    }

    fn open_unguarded(folder: &Path) -> fjall::Result<Self> {
        let inner = SingleWriterTxDatabase::builder(folder)
            .manual_journal_persist(true)
            .max_journaling_size(JOURNAL_BYTES)
            .cache_size(CACHE_BYTES)
            .worker_threads(1)
            .open()?;
        // Above this limit the database calls its worker at each write, and the worker's queue may be full. So there is
        // no limit, and `account` starts the writing of tables.
        let options = || KeyspaceCreateOptions::default().max_memtable_size(u64::MAX);
        Ok(Self {
            folder: folder.to_owned(),
            tables: Tables {
                rows: inner.keyspace("rows", options)?,
                states: inner.keyspace("states", options)?,
                ended: inner.keyspace("ended", options)?,
                notes: inner.keyspace("claims", options)?,
            },
            compaction: None,
            is_closing: Arc::default(),
            inner,
            // The journal's content is in memory again, and goes to tables with the first write.
            written_bytes: MEMTABLE_BYTES,
            dropped_bytes: 0,
        })
    }

    /// Whether the journals are still in the folder. The system goes on writing to removed files, which nobody can open
    /// again. A folder that cannot be read, for want of file descriptors say, counts as there.
    pub(super) fn is_there(&self) -> bool {
        match journal_paths(&self.folder) {
            Ok(paths) => !paths.is_empty(),
            Err(error) => error.kind() != io::ErrorKind::NotFound,
        }
    }

    /// Whether the disk is nearly full. A disk that does not tell its free space counts as empty.
    pub(super) fn is_nearly_full(&self) -> bool {
        let Ok(disk) = rustix::fs::statvfs(&self.folder) else {
            return false;
        };
        let bytes = |blocks: u64| blocks.saturating_mul(disk.f_frsize);
        bytes(disk.f_bavail) < (bytes(disk.f_blocks) / RESERVE).min(MAX_RESERVE)
    }

    pub(super) fn begin(&self, now: u64) -> Transaction<'_> {
        Transaction {
            inner: self.inner.write_tx(),
            database: self,
            now,
            written: Written::default(),
        }
    }

    pub(super) fn noted_time(&self) -> fjall::Result<Noted> {
        let noted = self.begin(0).note(CLOCK)?;
        Ok(noted.map_or_else(Noted::default, Noted::from_bytes))
    }

    pub(super) fn note_time(&mut self, noted: Noted) -> fjall::Result<()> {
        let mut transaction = self.begin(0);
        transaction.put_note(CLOCK, &noted.to_bytes());
        let written = transaction.write(PersistMode::Buffer)?;
        self.account(&written)
    }

    pub(super) fn sync(&self) -> fjall::Result<()> {
        self.inner.persist(PersistMode::SyncData)
    }

    /// Finds out whether a record of the usual size can be written, after writing has failed.
    pub(super) fn probe(&self) -> fjall::Result<()> {
        let mut probe = self.begin(0);
        let noise: Vec<u8> = (0..64 << 10).map(|i: u32| (i >> 3) as u8).collect();
        probe.inner.insert(&self.tables.states, NO_SESSION, noise);
        probe.write(PersistMode::SyncData)?;
        let mut clear = self.begin(0);
        clear.inner.remove(&self.tables.states, NO_SESSION);
        clear.write(PersistMode::SyncData)?;
        Ok(())
    }

    /// Drops expired entries. Returns whether there may be more of them.
    pub(super) fn sweep(&mut self, now: u64) -> fjall::Result<bool> {
        let snapshot = self.inner.read_tx();
        let mut sweep = self.begin(now);
        let mut rows = 0;
        for entry in snapshot.iter(&self.tables.rows) {
            let (id, row) = entry.into_inner()?;
            // A row of another format belongs to another version of the program, which sweeps it.
            if let Ok(row) = Row::from_bytes(&row)
                && row.expires <= now
            {
                sweep.written.dropped_bytes += row.state_bytes;
                sweep.inner.remove(&self.tables.rows, id.clone());
                sweep.inner.remove(&self.tables.states, id);
                sweep.written.bytes += 2 * ENTRY_BYTES;
                rows += 1;
            }
            if rows == SWEPT_ROWS {
                break;
            }
        }
        let mut marks = 0;
        for table in [&self.tables.ended, &self.tables.notes] {
            for entry in snapshot.iter(table) {
                if marks == SWEPT_ROWS {
                    break;
                }
                let (key, until) = entry.into_inner()?;
                if moment(&until).is_none_or(|until| until <= now) {
                    sweep.inner.remove(table, key);
                    sweep.written.bytes += ENTRY_BYTES;
                    marks += 1;
                }
            }
        }
        let written = sweep.write(PersistMode::Buffer)?;
        drop(snapshot);
        let bytes = written.dropped_bytes;
        if rows > 0 {
            tracing::debug!(rows, bytes, "sessions in the store have expired");
        }
        self.account(&written)?;
        Ok(rows == SWEPT_ROWS || marks == SWEPT_ROWS)
    }

    /// Counts what was written. From [`MEMTABLE_BYTES`] on, memory is written to tables; from [`COMPACTED_BYTES`] of
    /// dropped states on, their space is given back.
    pub(super) fn account(&mut self, written: &Written) -> fjall::Result<()> {
        self.written_bytes += written.bytes;
        self.dropped_bytes += written.dropped_bytes;
        if written.bytes > 0 && self.written_bytes >= MEMTABLE_BYTES {
            self.written_bytes = 0;
            // All tables are written, so that the journal up to here can be removed.
            for table in self.tables.all() {
                table.inner().rotate_memtable()?;
            }
        }
        let is_at_work = |thread: &JoinHandle<()>| !thread.is_finished();
        if self.dropped_bytes >= COMPACTED_BYTES
            && !self.compaction.as_ref().is_some_and(is_at_work)
        {
            self.compact();
        }
        Ok(())
    }

    /// Starts the thread that gives back space.
    fn compact(&mut self) {
        self.dropped_bytes = 0;
        let tables = [&self.tables.states, &self.tables.rows];
        let tables = tables.map(|table| table.inner().clone());
        let is_closing = self.is_closing.clone();
        let thread = std::thread::Builder::new().name("bagtrack-compact".to_owned());
        let compaction = thread.spawn(move || {
            if let Err(error) = compact(&tables, &is_closing) {
                tracing::error!(%error, "the store's space cannot be given back");
            }
        });
        self.compaction = compaction.ok();
    }
}

/// The calls of a group, which are written together. Each call reads before it writes, so a call that fails has written
/// nothing. In damaged tables the row and the state of a session may be of different frames: `Row::record` finds out.
pub(super) struct Transaction<'a> {
    pub(super) inner: SingleWriterWriteTx<'a>,
    pub(super) database: &'a Database,
    /// Milliseconds of the folder's time.
    pub(super) now: u64,
    pub(super) written: Written,
}

/// Counts of what a transaction writes.
#[derive(Default)]
pub(super) struct Written {
    /// Whether an answer promises that something written here is kept.
    pub(super) promises: bool,
    /// Bytes that were written.
    pub(super) bytes: u64,
    /// Bytes of the states that were dropped.
    pub(super) dropped_bytes: u64,
}

impl Transaction<'_> {
    pub(super) fn write(self, mode: PersistMode) -> fjall::Result<Written> {
        self.inner.durability(Some(mode)).commit()?;
        Ok(self.written)
    }
}

/// The moment with which an entry begins, in milliseconds of the folder's time: 8 bytes, big-endian. None where the
/// entry is shorter.
pub(super) fn moment(bytes: &[u8]) -> Option<u64> {
    let (moment, _) = bytes.split_first_chunk()?;
    Some(u64::from_be_bytes(*moment))
}

/// Rewrites tables without what was dropped from them.
fn compact(tables: &[Keyspace], is_closing: &AtomicBool) -> fjall::Result<()> {
    for table in tables {
        write_tables(table, is_closing)?;
        if !is_closing.load(Ordering::Acquire) {
            table.major_compact()?;
        }
    }
    // The database removes the replaced files when it writes the next tables.
    for table in tables {
        table.insert(NO_SESSION, [])?;
        write_tables(table, is_closing)?;
    }
    Ok(())
}

/// Writes what is in memory to tables.
fn write_tables(table: &Keyspace, is_closing: &AtomicBool) -> fjall::Result<()> {
    table.rotate_memtable()?;
    // Polls, because the database has no interruptible call that waits for its worker.
    while table.sealed_memtable_count() > 0 && !is_closing.load(Ordering::Acquire) {
        sleep(Duration::from_millis(10));
    }
    Ok(())
}
