//! The store in a folder: what it keeps through restarts, damage and a full disk, and what it gives back.

use crate::suite::{TTL, holds_for, is_committed, record};
use bagtrack_sessions::{
    Clock, Commit, Counted, Durability, FileStore, FileStoreError, Outcome, Record, SessionName,
    SessionStore, StoreShare, Version,
};
use std::fs::{self, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tempfile::TempDir;
use uuid::Uuid;

const LONG: Duration = Duration::from_secs(60);
const DURABILITIES: [Durability; 2] = [
    Durability::Each,
    Durability::Every(Duration::from_millis(50)),
];

fn open(folder: &Path, durability: Durability) -> Result<FileStore, FileStoreError> {
    FileStore::open(folder, durability, LONG, Clock::default())
}

pub fn open_by(folder: &Path, clock: &Clock) -> FileStore {
    FileStore::open(folder, Durability::default(), LONG, clock.clone()).unwrap()
}

/// A state of the usual size, which does not compress.
fn state(seed: u64) -> Vec<u8> {
    let mut number = seed.wrapping_mul(2).wrapping_add(1);
    let mut next = || {
        number = number
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (number >> 56) as u8
    };
    (0..36 << 10).map(|_| next()).collect()
}

/// A session in a store, as its client knows it.
pub struct Known {
    pub name: SessionName,
    pub version: Version,
    state: Vec<u8>,
}

impl Known {
    pub async fn create(store: &dyn SessionStore, seed: u64, ttl: Duration) -> Self {
        let (id, state) = (Uuid::from_u128(seed.into()), state(seed << 32));
        let mut written = record(seed, 0, &state);
        written.ttl = ttl;
        let created = store.create(id, &written).await.unwrap();
        assert!(is_committed(&created), "{created:?}");
        Self {
            name: SessionName {
                id,
                incarnation: seed,
            },
            version: written.version,
            state,
        }
    }

    pub async fn advance(&mut self, store: &dyn SessionStore) {
        self.advance_for(store, TTL).await;
    }

    pub async fn advance_for(&mut self, store: &dyn SessionStore, ttl: Duration) {
        let frame = self.version.frame + 1;
        let state = state((self.name.incarnation << 32) + frame);
        let commit = Commit {
            name: self.name,
            before: self.version,
            frame,
            state: Some(state.clone().into()),
            takes_over: false,
            ttl,
        };
        let committed = store.commit(commit).await.unwrap();
        assert!(is_committed(&committed), "{committed:?}");
        self.version = self.version.committed(frame, true);
        self.state = state;
    }

    pub fn is(&self, record: &Record) -> bool {
        record.version == self.version && record.state == self.state
    }
}

/// Sessions in a folder that was closed.
async fn filled(folder: &Path, sessions: u64, frames: usize) -> Vec<Known> {
    let store = open(folder, Durability::default()).unwrap();
    let mut all = Vec::new();
    for seed in 1..=sessions {
        all.push(Known::create(&store, seed, TTL).await);
    }
    for _ in 0..frames {
        for session in &mut all {
            session.advance(&store).await;
        }
    }
    all
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => files.extend(self::files(&path)),
            false => files.push(path),
        }
    }
    files.sort();
    files
}

pub fn copy(from: &Path) -> TempDir {
    let to = tempfile::tempdir().unwrap();
    for file in files(from) {
        let target = to.path().join(file.strip_prefix(from).unwrap());
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        fs::copy(&file, &target).unwrap();
    }
    to
}

#[tokio::test]
async fn the_store_in_a_folder_keeps_to_the_rules() {
    for durability in DURABILITIES {
        let folder = tempfile::tempdir().unwrap();
        let store = open(folder.path(), durability).unwrap();
        holds_for(&store).await;
        assert!(store.is_ready());
        assert_eq!(store.failures(), 0);
    }
}

#[tokio::test]
async fn what_was_written_is_there_after_a_restart() {
    for durability in DURABILITIES {
        let folder = tempfile::tempdir().unwrap();
        let store = open(folder.path(), durability).unwrap();
        let mut session = Known::create(&store, 1, TTL).await;
        let ended = Known::create(&store, 2, TTL).await;
        session.advance(&store).await;
        assert!(store.end(ended.name, TTL).await.unwrap());
        assert_eq!(store.secret([1; 32]).await.unwrap(), [1; 32]);
        drop(store);
        let store = open(folder.path(), durability).unwrap();
        let loaded = store.load(session.name.id).await.unwrap().unwrap();
        assert!(session.is(&loaded));
        let checked = store.check(ended.name, ended.version, true, None).await;
        assert_eq!(checked.unwrap(), Outcome::Tombstoned);
        assert_eq!(store.secret([2; 32]).await.unwrap(), [1; 32]);
        session.advance(&store).await;
    }
}

#[tokio::test]
async fn a_folder_is_one_stores_alone() {
    let folder = tempfile::tempdir().unwrap();
    let store = open(folder.path(), Durability::default()).unwrap();
    let refused = open(folder.path(), Durability::default()).unwrap_err();
    let text = refused.to_string();
    assert!(matches!(refused, FileStoreError::Locked(_)), "{text}");
    assert!(text.contains(folder.path().to_str().unwrap()), "{text}");
    drop(store);
    open(folder.path(), Durability::default()).unwrap();
}

#[tokio::test]
async fn a_folder_that_cannot_be_made_is_refused_with_what_the_system_says() {
    let parent = TempDir::new().unwrap();
    let file = parent.path().join("file");
    fs::write(&file, "a file").unwrap();
    let refused = open(&file.join("store"), Durability::default()).unwrap_err();
    let text = refused.to_string();
    assert!(matches!(refused, FileStoreError::Io { .. }), "{text}");
    assert!(text.contains("cannot be opened: Not a directory"), "{text}");
}

#[tokio::test]
async fn expired_sessions_are_swept_and_their_space_is_given_back() {
    let folder = tempfile::tempdir().unwrap();
    let clock = Clock::default();
    let open = || FileStore::open(folder.path(), Durability::default(), LONG, clock.clone());
    let store = open().unwrap();
    let disk = || {
        use std::os::unix::fs::MetadataExt;
        let sizes = files(folder.path());
        let blocks = sizes.iter().filter_map(|file| file.metadata().ok());
        blocks.map(|file| file.blocks() * 512).sum::<u64>()
    };
    let idle = Duration::from_secs(600);
    // 2,000 sessions of 36 KiB are 70 MiB. Each round's sessions expire, so only the journal could grow.
    for round in 0..4 {
        for seed in 1..=2000 {
            Known::create(&store, 2000 * round + seed, idle).await;
        }
        let full = disk();
        clock.advance(idle);
        let gone = store
            .load(Uuid::from_u128(u128::from(2000 * round + 1)))
            .await;
        assert_eq!(gone.unwrap(), None, "its time is over");
        // The files shrink without any call.
        let waits = bagtrack_sessions::clock::now();
        let mut left = disk();
        while left > 100 << 20 && waits.elapsed() < LONG {
            bagtrack_sessions::clock::sleep(Duration::from_millis(50)).await;
            left = disk();
        }
        let took = waits.elapsed();
        println!("{} MiB, after {took:?} {} MiB", full >> 20, left >> 20);
        assert!(left <= 100 << 20, "{} MiB are left", left >> 20);
    }
    drop(store);
    let store = open().unwrap();
    assert_eq!(store.load(Uuid::from_u128(1)).await.unwrap(), None);
}

/// Opens a damaged folder and looks at its sessions. Returns how many are whole, or why the folder was refused.
async fn look(folder: &Path, sessions: &[Known], damage: &str) -> Result<usize, String> {
    let store = open(folder, Durability::default());
    let store = store.map_err(|refused| {
        let text = refused.to_string();
        let is_other = matches!(
            refused,
            FileStoreError::Io { .. } | FileStoreError::Locked(_)
        );
        assert!(!is_other, "{damage}: {text}");
        assert!(text.contains(folder.to_str().unwrap()), "{damage}: {text}");
        text
    })?;
    let mut intact = 0;
    for session in sessions {
        // A record that is told has a state that was written.
        if let Ok(Some(record)) = store.load(session.name.id).await {
            let frame = record.version.frame;
            let written = state((session.name.incarnation << 32) + frame);
            assert!(record.state == written, "{damage}: another state");
            intact += usize::from(session.is(&record));
        }
    }
    Ok(intact)
}

#[tokio::test]
async fn a_write_that_was_cut_off_is_left_out_and_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let sessions = filled(folder.path(), 4, 3).await;
    let journal = files(folder.path())
        .into_iter()
        .find(|file| file.extension().is_some_and(|extension| extension == "jnl"))
        .unwrap();
    let bytes = fs::read(&journal).unwrap();
    let written = bytes.iter().rposition(|byte| *byte != 0).unwrap() + 1;
    let relative = journal.strip_prefix(folder.path()).unwrap();
    for cut in [1, 9, 40, 300, 20_000, 36_000] {
        let torn = copy(folder.path());
        let file = OpenOptions::new()
            .write(true)
            .open(torn.path().join(relative));
        file.unwrap().set_len((written - cut) as u64).unwrap();
        let log = Log::default();
        let intact = {
            let _logged = log.begin();
            look(torn.path(), &sessions, &format!("{cut} bytes cut off")).await
        };
        assert_eq!(intact, Ok(3), "{cut} bytes cut off");
        let told = format!(
            "bytes={}",
            left_out(torn.path(), relative, &bytes[..written - cut])
        );
        assert!(log.text().contains(&told), "{told}: {}", log.text());
    }
    let log = Log::default();
    let _logged = log.begin();
    let intact = look(folder.path(), &sessions, "nothing").await;
    assert_eq!((intact, log.text()), (Ok(4), String::new()));
}

/// How many bytes of a journal were left out when it was read. The journal ends after what was kept, or has zeros
/// there.
fn left_out(folder: &Path, journal: &Path, torn: &[u8]) -> usize {
    let kept = fs::read(folder.join(journal)).unwrap();
    let same = kept
        .iter()
        .zip(torn)
        .take_while(|(kept, torn)| kept == torn);
    torn.len() - same.count()
}

/// What this thread logs.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl Log {
    fn begin(&self) -> tracing::subscriber::DefaultGuard {
        let log = self.clone();
        let lines = tracing_subscriber::fmt().with_ansi(false);
        let lines = lines.with_max_level(tracing::Level::WARN);
        tracing::subscriber::set_default(lines.with_writer(move || log.clone()).finish())
    }

    fn text(&self) -> String {
        String::from_utf8(self.0.lock().unwrap().clone()).unwrap()
    }
}

impl io::Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[tokio::test]
async fn a_folder_that_cannot_be_written_is_tried_again_and_nothing_answered_is_lost() {
    let parent = TempDir::new().unwrap();
    let (folder, aside) = (parent.path().join("store"), parent.path().join("aside"));
    let store = open(&folder, DURABILITIES[1]).unwrap();
    let mut session = Known::create(&store, 1, TTL).await;
    session.advance(&store).await;
    // A file takes the folder's place: open files can still be written, but no new table can be made.
    fs::rename(&folder, &aside).unwrap();
    fs::write(&folder, "a file").unwrap();
    let mut seed = 1;
    let failed = loop {
        seed += 1;
        let record = record(seed, 0, &state(seed));
        match store.create(Uuid::from_u128(seed.into()), &record).await {
            Ok(created) => assert!(is_committed(&created), "{created:?}"),
            Err(failed) => break failed.to_string(),
        }
        assert!(seed < 5000, "180 MB were written into a file");
    };
    println!("{failed} after {seed} sessions");
    assert!(!store.is_ready());
    let failures = store.failures();
    assert!(failures > 0);
    assert!(store.load(session.name.id).await.is_err());
    assert!(store.failures() > failures);
    fs::remove_file(&folder).unwrap();
    fs::rename(&aside, &folder).unwrap();
    let waits = bagtrack_sessions::clock::now();
    while !store.is_ready() && waits.elapsed() < LONG {
        bagtrack_sessions::clock::sleep(Duration::from_millis(10)).await;
    }
    let loaded = store.load(session.name.id).await.unwrap().unwrap();
    assert!(session.is(&loaded));
    // The first write may have failed already, where the store was writing a table.
    if seed > 2 {
        let last = store.load(Uuid::from_u128(u128::from(seed - 1))).await;
        assert!(last.unwrap().unwrap().state == state(seed - 1));
    }
    session.advance(&store).await;
}

/// The files that a process leaves which is killed while it makes the store, after each step.
#[tokio::test]
async fn a_first_start_that_was_broken_off_is_begun_anew() {
    for step in ["lock", "keyspaces/", "0.jnl", "version", "keyspaces/0/"] {
        let folder = tempfile::tempdir().unwrap();
        for made in ["lock", "keyspaces/", "0.jnl", "version", "keyspaces/0/"] {
            let path = folder.path().join(made);
            match made.ends_with('/') {
                true => fs::create_dir_all(path).unwrap(),
                false => fs::write(path, []).unwrap(),
            }
            if made == step {
                break;
            }
        }
        let store = open(folder.path(), DURABILITIES[0]);
        let store = store.unwrap_or_else(|error| panic!("{step}: {error}"));
        Known::create(&store, 1, TTL).await;
        drop(store);
        open(folder.path(), DURABILITIES[0]).unwrap();
    }
}

#[tokio::test]
async fn a_store_whose_journal_is_gone_or_empty_is_refused() {
    for is_removed in [true, false] {
        let folder = tempfile::tempdir().unwrap();
        filled(folder.path(), 2, 3).await;
        for file in files(folder.path()) {
            match file.extension().is_some_and(|extension| extension == "jnl") {
                true if is_removed => fs::remove_file(file).unwrap(),
                true => fs::write(file, []).unwrap(),
                false => {}
            }
        }
        let refused = open(folder.path(), DURABILITIES[0])
            .unwrap_err()
            .to_string();
        assert!(refused.contains("the journal is gone"), "{refused}");
        assert!(refused.contains("put a copy"), "{refused}");
    }
}

#[tokio::test]
async fn damaged_files_are_refused_or_repaired_and_nothing_is_made_up() {
    let folder = tempfile::tempdir().unwrap();
    // Enough that states are in tables, too.
    let sessions = filled(folder.path(), 12, 45).await;
    let (mut refused, mut whole, mut partly) = (0, 0, 0);
    let all = files(folder.path());
    assert!(all.len() > 8, "{all:?}");
    for file in all {
        let relative = file.strip_prefix(folder.path()).unwrap();
        let bytes = fs::read(&file).unwrap();
        let written = bytes
            .iter()
            .rposition(|byte| *byte != 0)
            .map_or(0, |last| last + 1);
        for part in [0, 3, 7] {
            for is_cut in [true, false] {
                let at = (written * part / 8).min(written.saturating_sub(1));
                let damage = format!("{} cut: {is_cut}, at {at}", relative.display());
                let damaged = copy(folder.path());
                let mut copy = bytes.clone();
                match is_cut {
                    true => copy.truncate(at),
                    false if written > 0 => copy[at] ^= 1 << (part % 8),
                    false => continue,
                }
                fs::write(damaged.path().join(relative), &copy).unwrap();
                match look(damaged.path(), &sessions, &damage).await {
                    Err(_) => refused += 1,
                    Ok(12) => whole += 1,
                    Ok(_) => partly += 1,
                }
            }
        }
    }
    println!("refused {refused}, whole {whole}, in part {partly}");
    assert!(refused > 0 && whole > 0);
}

#[tokio::test]
async fn a_client_has_so_many_places_in_the_store_until_its_sessions_end_or_expire() {
    let (folder, clock) = (TempDir::new().unwrap(), Clock::default());
    let store = FileStore::open(folder.path(), DURABILITIES[1], LONG, clock.clone()).unwrap();
    let share = |client: &str| StoreShare {
        client: client.to_owned(),
        max_places: 3,
        max_bytes: 1 << 20,
    };
    let counted = |seed: u64| Counted {
        name: SessionName {
            id: Uuid::from_u128(seed.into()),
            incarnation: seed,
        },
        places: 1,
        bytes: 100 << 10,
        ttl: TTL,
    };
    for seed in 1..=3 {
        assert!(store.admit(&share("one"), counted(seed)).await.unwrap());
        Known::create(&store, seed, TTL).await;
    }
    assert!(!store.admit(&share("one"), counted(4)).await.unwrap());
    assert!(store.admit(&share("other"), counted(5)).await.unwrap());
    assert!(store.end(counted(2).name, TTL).await.unwrap());
    assert!(store.admit(&share("one"), counted(6)).await.unwrap());
    assert!(!store.admit(&share("one"), counted(7)).await.unwrap());
    // Sessions that nobody ends count until they expire.
    clock.advance(TTL);
    assert!(store.admit(&share("one"), counted(8)).await.unwrap());
}
