//! This version reads what earlier releases have written. It refuses what later ones write, and leaves it as it is.
//!
//! `tests/fixtures` has a folder for each release: sessions that stand at frame 2, as snapshots, as records of a Redis
//! (a file for each field) and in a store's folder, with their frames and the answers of the undisturbed run. A release
//! adds its own: `BAGTRACK_FIXTURES=tests/fixtures/vX.Y.Z cargo test -p bagtrack-sessions --features redis --test
//! store_protocol formats`.

use crate::common::{FIRST, FLOW, keys, place, request};
use crate::folder::copy;
use crate::pictures::{params, picture};
use crate::redis::Redis;
use crate::world::service;
use bagtrack_sessions::{
    Boxes, Clock, CreationKey, Durability, Estimates, FileStore, FrameBatch, Owner, PerTarget,
    RedisAddress, RedisStore, SNAPSHOT_MAGIC, SessionService, SessionStore, Start, Version,
};
use bagtrack_tracker::{Params, Preset, Rect};
use bytes::Bytes;
use fjall::{KeyspaceCreateOptions, PersistMode, SingleWriterTxDatabase};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};
use uuid::Uuid;

const LONG: Duration = Duration::from_secs(60);
/// The frame at which the sessions of a release stand, and the last one.
const AT: u64 = 2;
const LAST: u64 = 5;
/// In pixels. The tracker's sums are rounded differently by other vector units.
const TOLERANCE: f64 = 0.5;
/// A format that no version has.
const LATER: u8 = 99;

/// The time of day at which stores were written and are read.
fn when() -> SystemTime {
    SystemTime::UNIX_EPOCH + Duration::from_secs(1_800_000_000)
}

/// A session of each format of a state.
#[derive(Debug, Clone, Copy)]
enum Kind {
    One,
    List,
}

const KINDS: [Kind; 2] = [Kind::One, Kind::List];

impl Kind {
    fn id(self) -> Uuid {
        Uuid::from_u128(1 + self as u128)
    }

    fn name(self) -> &'static str {
        match self {
            Self::One => "one",
            Self::List => "list",
        }
    }

    fn boxes(self) -> Boxes {
        match self {
            Self::One => Boxes::One(FIRST),
            Self::List => Boxes::List(vec![FIRST, Rect::new(60.0, 40.0, 20.0, 16.0)]),
        }
    }

    fn params(self) -> Params {
        let mut robust = Preset::Robust.params();
        robust.particles = 20;
        match self {
            Self::One => params(7),
            Self::List => robust,
        }
    }
}

pub async fn open(service: &SessionService, id: Uuid, start: Start) {
    let request = request(service, Some(CreationKey::Id(id)), 0, start);
    let opened = service.open(request).await.unwrap();
    assert!(!opened.replayed);
}

/// The answer to a frame, or what the client is told.
pub async fn post(
    service: &SessionService,
    id: Uuid,
    (number, file): (u64, Bytes),
) -> Result<Estimates, String> {
    let found = service.find(id, &Owner::default(), FLOW).await;
    let session = found.map_err(|error| error.to_string())?;
    let batch = FrameBatch::posted(Some(number), vec![file], None);
    let tracked = service.advance(session.enter().unwrap(), place(service), batch);
    let mut tracked = tracked.await.map_err(|error| error.to_string())?;
    Ok(tracked.estimates.remove(0))
}

fn file_store(folder: &Path) -> Arc<FileStore> {
    let store = FileStore::open(folder, Durability::Each, LONG, Clock::with_wall(when));
    Arc::new(store.unwrap())
}

async fn redis_store(redis: &Redis) -> Arc<RedisStore> {
    let address = format!("redis://127.0.0.1:{}", redis.port);
    let address = RedisAddress::parse(&address, LONG).unwrap();
    Arc::new(
        RedisStore::connect(address, "formats", LONG, Clock::default())
            .await
            .unwrap(),
    )
}

/// The fixtures of a release.
struct Release(PathBuf);

impl Release {
    /// All fixtures in the project.
    fn all() -> Vec<Self> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
        let releases = fs::read_dir(folder).unwrap();
        let releases: Vec<Self> = releases
            .map(|folder| Self(folder.unwrap().path()))
            .collect();
        assert!(!releases.is_empty());
        releases
    }

    fn read(&self, file: &str) -> Vec<u8> {
        let path = self.0.join(file);
        fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    fn write(&self, file: &str, bytes: &[u8]) {
        let path = self.0.join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }

    fn frame(&self, number: u64) -> (u64, Bytes) {
        (number, self.read(&format!("frames/{number}.png")).into())
    }

    fn snapshot(&self, kind: Kind) -> Vec<u8> {
        self.read(&format!("{}.snapshot", kind.name()))
    }

    /// The fields of a record, as a Redis has them.
    fn record(&self, kind: Kind) -> BTreeMap<String, Vec<u8>> {
        let folder = self.0.join("redis").join(kind.name());
        let fields = fs::read_dir(folder).unwrap().map(|field| {
            let field = field.unwrap();
            let name = field.file_name().into_string().unwrap();
            (name, fs::read(field.path()).unwrap())
        });
        fields.collect()
    }

    /// Writes the fixtures of this version.
    async fn write_all(&self) {
        for number in 0..=LAST {
            self.write(&format!("frames/{number}.png"), &picture(0, number));
        }
        let start = |kind: Kind| Start::Frame {
            file: self.frame(0).1,
            boxes: kind.boxes(),
            params: Box::new(kind.params()),
        };
        for kind in KINDS {
            let undisturbed = service(None, 1);
            open(&undisturbed, kind.id(), start(kind)).await;
            let mut answers = Vec::new();
            for number in 1..=LAST {
                answers.push(
                    post(&undisturbed, kind.id(), self.frame(number))
                        .await
                        .unwrap(),
                );
            }
            let answers = serde_json::to_vec_pretty(&answers[AT as usize..]).unwrap();
            self.write(&format!("{}.json", kind.name()), &answers);
        }
        let store = file_store(&self.0.join("sessions"));
        let stored = service(Some(store.clone()), 1);
        for kind in KINDS {
            open(&stored, kind.id(), start(kind)).await;
            for number in 1..=AT {
                post(&stored, kind.id(), self.frame(number)).await.unwrap();
            }
            let session = stored
                .find(kind.id(), &Owner::default(), FLOW)
                .await
                .unwrap();
            let mut locked = session.enter().unwrap().lock().await.unwrap();
            let snapshot = locked.state().snapshot(&keys());
            self.write(&format!("{}.snapshot", kind.name()), &snapshot);
            let record = store.load(kind.id()).await.unwrap().unwrap();
            let text = |number: u64| number.to_string().into_bytes();
            let fields = [
                ("generation", text(record.version.generation)),
                ("frame", text(record.version.frame)),
                ("checkpoint", text(record.version.checkpoint)),
                ("token", b"a write".to_vec()),
                ("incarnation", text(record.opening.incarnation)),
                ("head", record.head()),
                ("state", record.state),
            ];
            for (name, value) in fields {
                self.write(&format!("redis/{}/{name}", kind.name()), &value);
            }
        }
        drop((stored, store));
        self.trim_journals();
    }

    /// Cuts the 64 MiB from the journals that the database has allocated and not written.
    fn trim_journals(&self) {
        for entry in fs::read_dir(self.0.join("sessions")).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|extension| extension == "jnl") {
                let bytes = fs::read(&path).unwrap();
                let written = bytes.iter().rposition(|byte| *byte != 0).unwrap();
                // The last write may end with zeros.
                fs::write(&path, &bytes[..bytes.len().min(written + 64)]).unwrap();
            }
        }
    }

    /// Checks that a session goes on as the undisturbed run of its release did.
    async fn goes_on(&self, service: &SessionService, kind: Kind) {
        let expected = self.read(&format!("{}.json", kind.name()));
        let expected: Vec<Estimates> = serde_json::from_slice(&expected).unwrap();
        for (number, expected) in (AT + 1..=LAST).zip(expected) {
            let answer = post(service, kind.id(), self.frame(number)).await.unwrap();
            let both = answer.as_slice().iter().zip(expected.as_slice());
            assert_eq!(answer.as_slice().len(), kind.boxes().as_slice().len());
            for (answer, expected) in both {
                let (got, wanted) = (answer.target, expected.target);
                let sides = [
                    got.x - wanted.x,
                    got.y - wanted.y,
                    got.width - wanted.width,
                    got.height - wanted.height,
                ];
                let apart = sides.map(|side| side.abs()).into_iter();
                let apart = apart.fold(0.0, f64::max);
                assert!(
                    apart <= TOLERANCE,
                    "{kind:?}, frame {number}: {apart} pixels"
                );
                assert_eq!((answer.frame, answer.status), (number, expected.status));
            }
        }
    }

    async fn snapshots_open(&self) {
        for kind in KINDS {
            let here = service(None, 1);
            let snapshot = Start::Snapshot(self.snapshot(kind).into());
            open(&here, kind.id(), snapshot).await;
            self.goes_on(&here, kind).await;
        }
    }

    async fn folder_opens(&self) {
        let folder = copy(&self.0.join("sessions"));
        let here = service(Some(file_store(folder.path())), 1);
        for kind in KINDS {
            self.goes_on(&here, kind).await;
        }
    }
}

#[tokio::test]
async fn sessions_of_earlier_releases_go_on() {
    for release in Release::all() {
        release.snapshots_open().await;
        release.folder_opens().await;
    }
}

#[tokio::test]
async fn this_version_reads_what_it_writes() {
    let folder = tempfile::tempdir().unwrap();
    let kept = std::env::var_os("BAGTRACK_FIXTURES").map(PathBuf::from);
    let release = Release(kept.unwrap_or_else(|| folder.path().to_owned()));
    release.write_all().await;
    release.snapshots_open().await;
    release.folder_opens().await;
}

#[tokio::test]
async fn a_snapshot_of_a_later_version_is_refused() {
    let release = &Release::all()[0];
    for kind in KINDS {
        let mut snapshot = release.snapshot(kind);
        snapshot[SNAPSHOT_MAGIC.len()] = LATER;
        let here = service(None, 1);
        let request = request(&here, None, 0, Start::Snapshot(snapshot.into()));
        let refused = here.open(request).await.unwrap_err().to_string();
        let told = "it has format version 99, and this service reads 4 and 5";
        assert!(refused.contains(told), "{refused}");
    }
}

/// Where a format version is, from the lengths of the bytes and of the head.
type Place = fn(usize, usize) -> usize;

/// Changes the row and the state of a session in a store's folder.
fn change(folder: &Path, id: Uuid, change: impl FnOnce(&mut Vec<u8>, &mut Vec<u8>)) {
    let database = SingleWriterTxDatabase::builder(folder).open().unwrap();
    let table = |name| {
        database
            .keyspace(name, KeyspaceCreateOptions::default)
            .unwrap()
    };
    let (rows, states) = (table("rows"), table("states"));
    let mut row = rows.get(id.as_bytes()).unwrap().unwrap().to_vec();
    let mut state = states.get(id.as_bytes()).unwrap().unwrap().to_vec();
    change(&mut row, &mut state);
    let mut write = database.write_tx();
    write.insert(&rows, id.as_bytes(), row);
    write.insert(&states, id.as_bytes(), state);
    write.commit().unwrap();
    database.persist(PersistMode::SyncAll).unwrap();
}

#[tokio::test]
async fn what_a_later_version_has_in_a_folder_is_refused_and_left_as_it_is() {
    let release = &Release::all()[0];
    let kind = Kind::One;
    let head = release.record(kind)["head"].len();
    // The head is the end of a row. A state follows the number of its frame.
    let places: [(bool, Place, &str); 3] = [
        (
            true,
            |_, _| 0,
            "the record has format 99, and this service reads 1",
        ),
        (
            true,
            |length, head| length - head,
            "the record has format 99, and this service reads 2",
        ),
        (
            false,
            |_, _| 8 + SNAPSHOT_MAGIC.len(),
            "it has format version 99, and this service reads 4 and 5",
        ),
    ];
    for (is_row, at, told) in places {
        let folder = copy(&release.0.join("sessions"));
        let mut before = 0;
        change(folder.path(), kind.id(), |row, state| {
            let bytes = if is_row { row } else { state };
            let at = at(bytes.len(), head);
            before = std::mem::replace(&mut bytes[at], LATER);
        });
        let older = service(Some(file_store(folder.path())), 1);
        let refused = post(&older, kind.id(), release.frame(AT + 1)).await;
        let refused = refused.unwrap_err();
        assert!(refused.contains(told), "{refused}");
        // The other sessions of the folder can be used meanwhile.
        release.goes_on(&older, Kind::List).await;
        drop(older);
        // The later version comes back, and finds its session unchanged.
        change(folder.path(), kind.id(), |row, state| {
            let bytes = if is_row { row } else { state };
            let at = at(bytes.len(), head);
            assert_eq!(bytes[at], LATER);
            bytes[at] = before;
        });
        let later = service(Some(file_store(folder.path())), 1);
        release.goes_on(&later, kind).await;
    }
}

/// If such a record were taken, frames would be counted from the record's number.
#[tokio::test]
async fn a_record_whose_state_is_of_another_frame_is_refused() {
    let release = &Release::all()[0];
    let folder = copy(&release.0.join("sessions"));
    let store = file_store(folder.path());
    let mut record = store.load(Kind::One.id()).await.unwrap().unwrap();
    record.version = Version::first(AT + 1);
    let other = Uuid::from_u128(9);
    store.create(other, &record).await.unwrap();
    let here = service(Some(store), 1);
    let refused = post(&here, other, release.frame(AT + 2)).await;
    let refused = refused.unwrap_err();
    assert!(refused.contains("it is damaged"), "{refused}");
    release.goes_on(&here, Kind::One).await;
}

/// The record of a session, as a Redis has it.
async fn fields(
    redis: &mut redis::aio::MultiplexedConnection,
    id: Uuid,
) -> BTreeMap<String, Vec<u8>> {
    let fields = redis::cmd("HGETALL").arg(key(id)).query_async(redis).await;
    fields.unwrap()
}

fn key(id: Uuid) -> String {
    format!("formats:session:{{{id}}}")
}

async fn put(redis: &mut redis::aio::MultiplexedConnection, id: Uuid, field: &str, value: &[u8]) {
    let mut set = redis::cmd("HSET");
    set.arg(key(id)).arg(field).arg(value);
    let _: () = set.query_async(redis).await.unwrap();
}

#[tokio::test]
#[ignore = "needs redis-server"]
async fn records_of_earlier_releases_go_on_and_those_of_later_ones_are_left_as_they_are() {
    for release in Release::all() {
        let redis = Redis::start();
        let client = redis::Client::open(format!("redis://127.0.0.1:{}", redis.port)).unwrap();
        let mut link = client.get_multiplexed_async_connection().await.unwrap();
        for kind in KINDS {
            let record = release.record(kind);
            for (field, value) in &record {
                put(&mut link, kind.id(), field, value).await;
            }
            // A replica of this version, beside one that has begun to write another format of the head, or of the
            // state.
            let state = SNAPSHOT_MAGIC.len();
            for (field, at) in [("head", 0), ("state", state)] {
                let mut later = record[field].clone();
                later[at] = LATER;
                put(&mut link, kind.id(), field, &later).await;
                let before = fields(&mut link, kind.id()).await;
                let older = service(Some(redis_store(&redis).await), 1);
                let refused = post(&older, kind.id(), release.frame(AT + 1)).await;
                let refused = refused.unwrap_err();
                assert!(refused.contains("99, and this service reads"), "{refused}");
                assert_eq!(fields(&mut link, kind.id()).await, before);
                put(&mut link, kind.id(), field, &record[field]).await;
            }
            let here = service(Some(redis_store(&redis).await), 1);
            release.goes_on(&here, kind).await;
            let now = fields(&mut link, kind.id()).await;
            assert!(now.keys().eq(record.keys()), "a record's fields");
            // A session that this version opens has the same fields.
            let new = Uuid::from_u128(9);
            let file = release.frame(0).1;
            let (boxes, params) = (PerTarget::One(FIRST), Box::new(params(1)));
            if let Kind::One = kind {
                open(
                    &here,
                    new,
                    Start::Frame {
                        file,
                        boxes,
                        params,
                    },
                )
                .await;
            }
            assert!(fields(&mut link, new).await.keys().eq(record.keys()));
        }
    }
}
