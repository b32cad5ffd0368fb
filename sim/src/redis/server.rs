//! The server: its keys, whether it is there, and how fast.

use super::keyspace::Keyspace;
use super::lua;
use crate::journal::Journal;
use bagtrack_sessions::NewHash;
use bagtrack_sessions::clock::{Instant, now};
use redis::{ErrorKind, RedisError, RedisResult, Value};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// What the heads of records begin with (docs/RELIABILITY.md): replicas of other versions go by it.
const HEAD_FORMAT: u8 = 2;

/// The server. Clones are the same.
#[derive(Debug, Clone)]
pub struct Server {
    begin: Instant,
    shared: Arc<Mutex<Shared>>,
    journal: Journal,
}

#[derive(Debug, Default)]
struct Shared {
    keyspace: Keyspace,
    is_away: bool,
    slow_by: Duration,
    /// Counts the restarts: lines of before are broken.
    epoch: u64,
}

impl Server {
    /// A server without keys, which tells this journal what is written.
    pub fn new(journal: Journal) -> Self {
        Self {
            begin: now(),
            shared: Arc::default(),
            journal,
        }
    }

    /// Makes a hash and runs a script, and journals what its session has then.
    ///
    /// # Errors
    /// The server is away, or refuses the script.
    pub fn run(
        &self,
        new: Option<&NewHash>,
        script: &str,
        keys: &[String],
        args: &[Vec<u8>],
    ) -> RedisResult<Value> {
        let mut shared = self.lock();
        if shared.is_away {
            return Err(broken());
        }
        shared.keyspace.now = self.milliseconds();
        if let Some(new) = new {
            shared.keyspace.make_hash(new).map_err(refusal)?;
        }
        let answer = lua::run(&mut shared.keyspace, script, keys, args);
        if let Some(id) = keys.first().and_then(|key| session_of(key)) {
            let mut field = |name: &str| {
                let text = shared.keyspace.field(keys[0].as_bytes(), name)?;
                std::str::from_utf8(&text).ok()?.parse().ok()
            };
            if let (Some(frame), Some(checkpoint)) = (field("frame"), field("checkpoint")) {
                self.journal.stored(id, frame, checkpoint);
            }
            let head = shared.keyspace.field(keys[0].as_bytes(), "head");
            if head.is_some_and(|head| head.first() != Some(&HEAD_FORMAT)) {
                let fault = format!("the record of {id} does not begin with its format");
                self.journal.fault(fault);
            }
        }
        answer.map_err(refusal)
    }

    /// Whether it answers now, and how slowly; and how often it was restarted.
    pub fn state(&self) -> (bool, Duration, u64) {
        let shared = self.lock();
        (!shared.is_away, shared.slow_by, shared.epoch)
    }

    /// It goes, with all lines to it.
    pub fn leave(&self) {
        let mut shared = self.lock();
        shared.is_away = true;
        shared.epoch += 1;
    }

    /// It is back, with the keys that it had.
    pub fn come_back(&self) {
        self.lock().is_away = false;
    }

    /// Each answer takes so much longer.
    pub fn slow_down(&self, by: Duration) {
        self.lock().slow_by = by;
    }

    /// The keys that have not expired.
    pub fn live_keys(&self) -> Vec<String> {
        let mut shared = self.lock();
        shared.keyspace.now = self.milliseconds();
        shared.keyspace.live_keys()
    }

    fn milliseconds(&self) -> u64 {
        u64::try_from(self.begin.elapsed().as_millis()).unwrap_or(u64::MAX)
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn refusal(error: String) -> RedisError {
    RedisError::from((ErrorKind::Extension, "a script failed", error))
}

/// The session whose record has this key.
pub fn session_of(key: &str) -> Option<&str> {
    let (_, rest) = key.split_once(":session:{")?;
    rest.strip_suffix('}')
}

/// The line to the server broke.
pub fn broken() -> RedisError {
    RedisError::from((ErrorKind::Io, "the line broke"))
}
