//! The records behind a store that misbehaves: in memory, or in a folder.

use bagtrack_sessions::{
    Clock, Commit, Durability, FileStore, Outcome, Record, SessionName, SessionStore, Version,
};
use futures_util::future::FutureExt;
use std::time::Duration;
use tempfile::TempDir;
use uuid::Uuid;

const LONG: Duration = Duration::from_secs(3600);

/// Does the calls of a store, at once.
pub trait Backend: Send {
    /// A call with the token of the last write does nothing.
    fn create(&mut self, token: u64, id: Uuid, record: &Record) -> Outcome;
    fn load(&mut self, id: Uuid) -> Option<Record>;
    fn commit(&mut self, token: u64, commit: Commit) -> Outcome;
    fn check(&mut self, name: SessionName, version: Version, takes_over: bool) -> Outcome;
    fn fence(&mut self, name: SessionName, version: Version) -> Outcome;
    fn end(&mut self, name: SessionName) -> bool;
    fn secret(&mut self, new: [u8; 32]) -> [u8; 32];
    /// Loses all records.
    fn forget(&mut self);
    /// Ends, and begins again with what was kept.
    fn restart(&mut self);
    /// Whether tokens are known.
    fn knows_repeats(&self) -> bool;
}

/// Records in a folder.
pub struct InFolder {
    folder: TempDir,
    /// `None` while it is opened again.
    store: Option<FileStore>,
}

impl Default for InFolder {
    fn default() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        Self {
            store: Some(open(&folder)),
            folder,
        }
    }
}

fn open(folder: &TempDir) -> FileStore {
    let opened = FileStore::open(folder.path(), Durability::default(), LONG, Clock::default());
    opened.expect("the folder of this test")
}

impl InFolder {
    fn store(&self) -> &FileStore {
        self.store.as_ref().expect("it is open")
    }

    /// Waits for an answer of the store's thread, which does not depend on this one.
    fn wait<T>(future: bagtrack_sessions::StoreFuture<'_, T>) -> T {
        let mut future = future;
        loop {
            if let Some(answer) = (&mut future).now_or_never() {
                return answer.expect("the disk takes writes");
            }
            std::thread::yield_now();
        }
    }
}

impl Backend for InFolder {
    fn create(&mut self, _token: u64, id: Uuid, record: &Record) -> Outcome {
        Self::wait(self.store().create(id, record))
    }

    fn load(&mut self, id: Uuid) -> Option<Record> {
        Self::wait(self.store().load(id))
    }

    fn commit(&mut self, _token: u64, commit: Commit) -> Outcome {
        Self::wait(self.store().commit(commit))
    }

    fn check(&mut self, name: SessionName, version: Version, takes_over: bool) -> Outcome {
        Self::wait(self.store().check(name, version, takes_over, None))
    }

    fn fence(&mut self, name: SessionName, version: Version) -> Outcome {
        Self::wait(self.store().fence(name, version))
    }

    fn end(&mut self, name: SessionName) -> bool {
        Self::wait(self.store().end(name, LONG))
    }

    fn secret(&mut self, new: [u8; 32]) -> [u8; 32] {
        Self::wait(self.store().secret(new))
    }

    fn forget(&mut self) {
        *self = Self::default();
    }

    fn restart(&mut self) {
        self.store = None;
        self.store = Some(open(&self.folder));
    }

    fn knows_repeats(&self) -> bool {
        false
    }
}
