//! The simulated Redis server: its keys, whether it is reachable, and how slow it is.

use super::keyspace::Keyspace;
use super::lua;
use crate::journal::Journal;
use bagtrack_sessions::NewHash;
use bagtrack_sessions::clock::{Instant, now};
use redis::{ErrorKind, RedisError, RedisResult, Value};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The first byte of each record's head (docs/RELIABILITY.md), by which replicas of other versions know the format.
const HEAD_FORMAT: u8 = 2;

/// The server. Clones share its keys.
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
    /// Counts the restarts: connections from before a restart are broken.
    epoch: u64,
}

impl Server {
    /// A server without keys, which tells `journal` which frames and checkpoints are written.
    pub fn new(journal: Journal) -> Self {
        Self {
            begin: now(),
            shared: Arc::default(),
            journal,
        }
    }

    /// Makes the hash `new`, if given, runs a script, and journals the frame and the checkpoint of its session's
    /// record.
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

    /// Whether the server is reachable, how much longer its answers take, and how often it was restarted.
    pub fn state(&self) -> (bool, Duration, u64) {
        let shared = self.lock();
        (!shared.is_away, shared.slow_by, shared.epoch)
    }

    /// Makes the server unreachable, and breaks all connections to it.
    pub fn leave(&self) {
        let mut shared = self.lock();
        shared.is_away = true;
        shared.epoch += 1;
    }

    /// Makes the server reachable again, with the keys that it had.
    pub fn come_back(&self) {
        self.lock().is_away = false;
    }

    /// From now on each answer takes longer by this time.
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

/// The id of the session whose record has this key.
pub fn session_of(key: &str) -> Option<&str> {
    let (_, rest) = key.split_once(":session:{")?;
    rest.strip_suffix('}')
}

/// The error of a broken connection to the server.
pub fn broken() -> RedisError {
    RedisError::from((ErrorKind::Io, "the line broke"))
}
