//! A store with one record of arbitrary bytes, like one in a Redis or in a folder.

use crate::service::{content_of_stored, stored_of};
use bagtrack_sessions::{
    record_of_row, row_and_state, Clock, Commit, NewHash, Outcome, Record, RedisAddress,
    RedisStore, ScriptServer, SessionName, SessionState, SessionStore, StoreFuture,
    StoreUnavailable, Version,
};
use redis::{RedisFuture, Value};
use std::io;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;
use uuid::Uuid;

/// The time limit of calls to the store, and the life of sessions in it.
const LONG: Duration = Duration::from_secs(3600);
/// Most stored answers that the store reads.
pub const MAX_RECENT: usize = 4;

/// The record in the store.
#[derive(Debug, Clone)]
pub enum Stored {
    /// The answer of a Redis: milliseconds to live, then the fields of the record.
    Redis {
        ttl: i64,
        generation: Vec<u8>,
        checkpoint: Vec<u8>,
        head: Vec<u8>,
        state: Vec<u8>,
    },
    /// The rows in the tables of a folder.
    Folder { row: Vec<u8>, state: Vec<u8> },
}

/// A folder's, and not of a Redis.
const FOLDER: u8 = 1;
/// With the content of a state, which is not compressed, so that a change meets a part of it.
const CONTENT: u8 = 2;
/// Of a session with a list of targets.
const LIST: u8 = 4;

impl Stored {
    /// What an input stands for: a byte of flags; the length of a row or head in two bytes, little-endian, and its
    /// bytes; a state, of a folder after the number of its frame in eight bytes. Before a head are three lines:
    /// milliseconds to live, generation, checkpoint.
    pub fn of(input: &[u8]) -> Option<Self> {
        let (&[flags, low, high], rest) = input.split_first_chunk()?;
        let length = usize::from(u16::from_le_bytes([low, high]));
        let (head, state) = rest.split_at_checked(length)?;
        let (frame, content) = match flags & FOLDER {
            0 => state.split_at(0),
            _ => state.split_at_checked(8)?,
        };
        let state = match flags & CONTENT {
            0 => state.to_vec(),
            _ => {
                let version = if flags & LIST == 0 { 4 } else { 5 };
                [frame, &stored_of(version, content)].concat()
            }
        };
        if flags & FOLDER != 0 {
            let row = head.to_vec();
            return Some(Self::Folder { row, state });
        }
        let mut parts = head.splitn(4, |byte| *byte == b'\n').map(<[u8]>::to_vec);
        let ttl = String::from_utf8(parts.next()?).ok()?;
        Some(Self::Redis {
            ttl: ttl.parse().ok()?,
            generation: parts.next()?,
            checkpoint: parts.next()?,
            head: parts.next()?,
            state,
        })
    }

    /// The inputs that stand for a record: of a Redis and of a folder, with its state as it is, and with its content.
    pub fn inputs(record: &Record) -> io::Result<[Vec<u8>; 4]> {
        let (row, in_folder) = row_and_state(record);
        let (version, content) = content_of_stored(&record.state)?;
        let list = if version == 5 { LIST } else { 0 };
        let Version {
            generation,
            checkpoint,
            ..
        } = record.version;
        let ttl = record.ttl.as_millis();
        let lines = format!("{ttl}\n{generation}\n{checkpoint}\n");
        let head = [lines.as_bytes(), &record.head()].concat();
        let content_in_folder = [&in_folder[..8], &content].concat();
        let input = |flags: u8, head: &[u8], state: &[u8]| {
            let length = u16::try_from(head.len()).expect("heads are small");
            [&[flags][..], &length.to_le_bytes(), head, state].concat()
        };
        Ok([
            input(0, &head, &record.state),
            input(FOLDER, &row, &in_folder),
            input(CONTENT | list, &head, &content),
            input(FOLDER | CONTENT | list, &row, &content_in_folder),
        ])
    }
}

/// The store. Clones are the same.
#[derive(Debug, Clone)]
pub struct Shelf {
    stored: Place,
    /// The records that were created, and their later versions.
    written: Arc<Mutex<Vec<Record>>>,
    redis: RedisStore,
}

type Place = Arc<Mutex<Option<Stored>>>;

/// Answers in place of a Redis.
#[derive(Debug)]
struct Server(Place);

impl ScriptServer for Server {
    /// Whatever the script: the record has another version.
    fn run<'a>(
        &'a self,
        _new: Option<&'a NewHash>,
        _script: &'a str,
        _keys: &'a [String],
        _args: &'a [Vec<u8>],
    ) -> RedisFuture<'a, Value> {
        let stored = lock(&self.0).clone();
        let answer = match stored {
            Some(Stored::Redis {
                ttl,
                generation,
                checkpoint,
                head,
                state,
            }) => {
                let fields = [generation, checkpoint, head, state];
                let fields = fields.map(Value::BulkString).to_vec();
                let fields = Value::Array(fields);
                vec![Value::Int(2), Value::Int(ttl), fields]
            }
            _ => vec![Value::Int(0)],
        };
        Box::pin(async { Ok(Value::Array(answer)) })
    }
}

impl Shelf {
    pub async fn new() -> Self {
        let stored = Place::default();
        let address = RedisAddress::of(Arc::new(Server(stored.clone())));
        let redis = RedisStore::connect(address, "fuzz", LONG, Clock::default()).await;
        Self {
            stored,
            written: Arc::default(),
            redis: redis.expect("it can be used"),
        }
    }

    /// Replaces the record.
    pub fn put(&self, stored: Option<Stored>) {
        *lock(&self.stored) = stored;
    }

    /// The records that were written since the last call, oldest first.
    pub fn take_written(&self) -> Vec<Record> {
        std::mem::take(&mut *lock(&self.written))
    }

    /// The record, as a service reads it.
    pub async fn record(&self, id: Uuid) -> Result<Option<Record>, StoreUnavailable> {
        let stored = lock(&self.stored).clone();
        match stored {
            None => Ok(None),
            Some(Stored::Redis { .. }) => self.redis.load(id).await,
            Some(Stored::Folder { row, state }) => {
                let record = record_of_row(&row, &state);
                let record = record.map_err(|error| StoreUnavailable(error.to_string()))?;
                Ok(Some(record))
            }
        }
    }
}

fn lock<T>(place: &Mutex<T>) -> MutexGuard<'_, T> {
    place.lock().expect("nothing panics while it is held")
}

impl SessionStore for Shelf {
    fn create<'a>(&'a self, id: Uuid, record: &'a Record) -> StoreFuture<'a, Outcome> {
        Box::pin(async move {
            if let Some(there) = self.record(id).await? {
                return Ok(Outcome::Conflict(Box::new(there)));
            }
            lock(&self.written).push(record.clone());
            Ok(Outcome::Committed(record.ttl))
        })
    }

    fn load(&self, id: Uuid) -> StoreFuture<'_, Option<Record>> {
        Box::pin(self.record(id))
    }

    /// Checks that the service can read the records that it writes.
    fn commit(&self, commit: Commit) -> StoreFuture<'_, Outcome> {
        Box::pin(async move {
            if let Some(state) = commit.state {
                let read = SessionState::from_stored(&state, MAX_RECENT, None, None);
                let read = read.expect("a state that was written is read");
                assert_eq!(read.latest_frame(), commit.frame);
                let mut written = lock(&self.written);
                if let Some(last) = written.last().cloned() {
                    let version = commit.before.committed(commit.frame, true);
                    let state = state.to_vec();
                    written.push(Record {
                        version,
                        state,
                        ..last
                    });
                }
            }
            Ok(Outcome::Committed(commit.ttl))
        })
    }

    fn check(
        &self,
        _: SessionName,
        _: Version,
        _: bool,
        _: Option<Duration>,
    ) -> StoreFuture<'_, Outcome> {
        Box::pin(async { Ok(Outcome::Committed(LONG)) })
    }

    fn fence(&self, _: SessionName, version: Version) -> StoreFuture<'_, Outcome> {
        let _ = version.fenced();
        Box::pin(async { Ok(Outcome::Committed(LONG)) })
    }

    fn end(&self, _: SessionName, _: Duration) -> StoreFuture<'_, bool> {
        Box::pin(async { Ok(true) })
    }

    fn secret(&self, new: [u8; 32]) -> StoreFuture<'_, [u8; 32]> {
        Box::pin(async move { Ok(new) })
    }
}
