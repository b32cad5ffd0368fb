//! A store in Redis or Valkey: each call is one script.

use super::super::record::{MAX_TTL, Record, SessionName, Version};
use super::super::session_store::{
    Commit, Counted, Outcome, SessionStore, StoreFuture, StoreShare, StoreUnavailable, milliseconds,
};
use super::address::RedisAddress;
use super::connection::Connection;
use super::scripts::{NewHash, Script, ScriptCall, Scripts};
use crate::clock::{Clock, sleep};
use crate::random::random;
use crate::sync::{Mutex, lock};
use redis::FromRedisValue;
use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Weak};
use std::time::Duration;
use uuid::Uuid;

/// How long an uploaded state stays at the server if the script that commits it does not run.
const UNCOMMITTED: Duration = Duration::from_secs(10);
/// How long the secret stays after a session was last opened with an idempotency key.
const SECRET: Duration = Duration::from_secs(30 * 24 * 3600);
/// How long a client's sessions are counted after it opened the last one.
const COUNTED: Duration = Duration::from_secs(7 * 24 * 3600);
/// If a client has no room for a new session, so many of its sessions at a time are checked for whether they still
/// live.
const LOOKED_AT: usize = 32;
/// How often [`LOOKED_AT`] sessions are checked before the new session is refused.
const MAX_LOOKS: usize = 4;
/// How long the client is then refused without another check.
const REFUSED: Duration = Duration::from_secs(1);
/// How often the store is asked whether it is there.
const PROBE: Duration = Duration::from_millis(250);

/// The store. Clones are the same store.
#[derive(Clone)]
pub struct RedisStore(Arc<Shared>);

/// A record's fields as the scripts tell them: generation, checkpoint, head, state.
type Fields = (u64, u64, Vec<u8>, Vec<u8>);

struct Shared {
    connection: Connection,
    scripts: Scripts,
    prefix: String,
    clock: Clock,
    /// Whether the store has no room for new sessions.
    is_full: AtomicBool,
    /// For each refused client, the moment by the clock until which it is refused without another check.
    refused: Mutex<HashMap<String, Duration>>,
}

impl Shared {
    async fn probe(&self) {
        let key = format!("{}:probe", self.prefix);
        let write = self.scripts.probe.key(key);
        if let Ok(is_full) = self.connection.probe(write).await {
            self.is_full.store(is_full, Ordering::Relaxed);
        }
    }
}

/// Asks the store every [`PROBE`] whether it is there, as long as somebody uses it.
async fn probe(store: Weak<Shared>) {
    while let Some(store) = store.upgrade() {
        store.probe().await;
        drop(store);
        sleep(PROBE).await;
    }
}

/// Reads the answer of a script.
impl FromRedisValue for Outcome {
    fn from_redis_value(value: redis::Value) -> Result<Self, redis::ParsingError> {
        let parts: Vec<redis::Value> = FromRedisValue::from_redis_value(value)?;
        let mut parts = parts.into_iter();
        let mut next = || parts.next().ok_or("too few values");
        match i64::from_redis_value(next()?)? {
            0 => Ok(Self::NotFound),
            3 => Ok(Self::Tombstoned),
            4 => Ok(Self::Full),
            kind => {
                let ttl = i64::from_redis_value(next()?)?;
                let ttl = Duration::from_millis(u64::try_from(ttl).unwrap_or(0)).min(MAX_TTL);
                if kind == 1 {
                    return Ok(Self::Committed(ttl));
                }
                let (generation, checkpoint, head, state) = Fields::from_redis_value(next()?)?;
                let record = Record::at_checkpoint(generation, checkpoint, &head, state, ttl);
                let record = record.map_err(|error| error.to_string())?;
                Ok(Self::Conflict(Box::new(record)))
            }
        }
    }
}

impl RedisStore {
    /// The store at this address. The keys of its records begin with `prefix`. Calls end after `timeout`; `clock` tells
    /// when sessions were counted. Waits for the first answer, and goes on without one after `timeout`.
    ///
    /// # Errors
    /// The address cannot be used.
    pub async fn connect(
        address: RedisAddress,
        prefix: &str,
        timeout: Duration,
        clock: Clock,
    ) -> Result<Self, StoreUnavailable> {
        let connection = Connection::new(address, timeout);
        let connection = connection.map_err(|error| StoreUnavailable(error.to_string()))?;
        let shared = Arc::new(Shared {
            connection,
            scripts: Scripts::new(),
            prefix: prefix.to_owned(),
            clock,
            is_full: AtomicBool::new(false),
            refused: Mutex::default(),
        });
        shared.probe().await;
        tokio::spawn(probe(Arc::downgrade(&shared)));
        Ok(Self(shared))
    }

    /// Milliseconds since 1970.
    fn now(&self) -> u64 {
        let clock = &self.0.clock;
        milliseconds(clock.since_1970(clock.now()))
    }

    /// The key of a record. Braces make a cluster keep the keys of a session at one node.
    fn key(&self, id: Uuid) -> String {
        format!("{}:session:{{{id}}}", self.0.prefix)
    }

    /// The key of a client's counted sessions.
    fn key_of_client(&self, client: &str) -> String {
        let name = blake3::hash(client.as_bytes()).to_hex();
        format!("{}:client:{name}", self.0.prefix)
    }

    /// Counts a session. If the client has no room for it, returns those of its sessions that were checked longest ago.
    async fn try_admit(
        &self,
        share: &StoreShare,
        session: Counted,
    ) -> Result<Option<Vec<String>>, StoreUnavailable> {
        let SessionName { id, incarnation } = session.name;
        let (places, bytes) = (session.places, session.bytes);
        let member = format!("{id}:{incarnation}:{places}:{bytes}");
        let mut script = self.0.scripts.admit.key(self.key_of_client(&share.client));
        script.arg(member).arg(self.now());
        script.arg(share.max_places).arg(share.max_bytes);
        script.arg(milliseconds(COUNTED)).arg(LOOKED_AT);
        let answer: (i64, Vec<String>) = self.0.connection.call(script).await?;
        Ok((answer.0 == 0).then_some(answer.1))
    }

    /// Whether no room was found for a client a moment ago.
    fn is_refused(&self, client: &str) -> bool {
        let now = self.0.clock.now();
        lock(&self.0.refused)
            .get(client)
            .is_some_and(|until| *until > now)
    }

    /// Refuses a client for [`REFUSED`] without another check.
    fn refuse(&self, client: &str) {
        let now = self.0.clock.now();
        let mut refused = lock(&self.0.refused);
        refused.retain(|_, until| *until > now);
        refused.insert(client.to_owned(), now + REFUSED);
    }

    /// Finds out which of these sessions of a client live, and no longer counts the others. This takes a script for
    /// each, as their records may be at other nodes.
    async fn recount(
        &self,
        share: &StoreShare,
        members: Vec<String>,
    ) -> Result<(), StoreUnavailable> {
        for member in members {
            let mut parts = member.split(':');
            let id = parts.next().and_then(|id| id.parse().ok());
            let (Some(id), Some(incarnation)) = (id, parts.next()) else {
                continue;
            };
            let mut lives = self.0.scripts.lives.key(self.key(id));
            lives.arg(incarnation);
            let lives: bool = self.0.connection.call(lives).await?;
            let mut script = self
                .0
                .scripts
                .recount
                .key(self.key_of_client(&share.client));
            script.arg(&member).arg(if lives { self.now() } else { 0 });
            let _: i64 = self.0.connection.call(script).await?;
        }
        Ok(())
    }

    fn on<'a>(&self, script: &'a Script, name: SessionName) -> ScriptCall<'a> {
        let SessionName { id, incarnation } = name;
        let mut invocation = script.key(self.key(id));
        let ended = format!("{}:ended:{{{id}}}:{incarnation:016x}", self.0.prefix);
        invocation.key(ended);
        invocation
    }
}

impl SessionStore for RedisStore {
    fn create<'a>(&'a self, id: Uuid, record: &'a Record) -> StoreFuture<'a, Outcome> {
        let (version, incarnation) = (record.version, record.opening.incarnation);
        let mut script = self.on(&self.0.scripts.create, SessionName { id, incarnation });
        script.arg(version.generation).arg(version.frame);
        script.arg(token()).arg(incarnation);
        script.arg(record.head()).arg(&record.state[..]);
        script.arg(milliseconds(record.ttl));
        Box::pin(async move {
            let outcome: Outcome = self.0.connection.call(script).await?;
            let is_full = outcome == Outcome::Full;
            self.0.is_full.store(is_full, Ordering::Relaxed);
            Ok(outcome)
        })
    }

    fn admit<'a>(&'a self, share: &'a StoreShare, session: Counted) -> StoreFuture<'a, bool> {
        Box::pin(async move {
            for _ in 0..MAX_LOOKS {
                let Some(counted) = self.try_admit(share, session).await? else {
                    return Ok(true);
                };
                if self.is_refused(&share.client) {
                    return Ok(false);
                }
                let are_all = counted.len() < LOOKED_AT;
                self.recount(share, counted).await?;
                if are_all {
                    break;
                }
            }
            let is_admitted = self.try_admit(share, session).await?.is_none();
            if !is_admitted {
                self.refuse(&share.client);
            }
            Ok(is_admitted)
        })
    }

    fn load(&self, id: Uuid) -> StoreFuture<'_, Option<Record>> {
        let mut script = self.0.scripts.check.key(self.key(id));
        // The second key should be the mark of an ended session, which does not matter here. No record has the empty
        // version, so one that is there is told as a conflict.
        script.key(self.key(id));
        script.arg("").arg("").arg("");
        Box::pin(async move {
            match self.0.connection.call(script).await? {
                Outcome::Conflict(record) => Ok(Some(*record)),
                _ => Ok(None),
            }
        })
    }

    fn commit(&self, commit: Commit) -> StoreFuture<'_, Outcome> {
        let before = commit.before;
        let mut script = self.on(&self.0.scripts.commit, commit.name);
        let token = token();
        if let Some(state) = commit.state {
            let (prefix, id) = (&self.0.prefix, commit.name.id);
            script.on_new(NewHash {
                key: format!("{prefix}:new:{{{id}}}:{token}"),
                field: "state",
                value: state,
                ttl: UNCOMMITTED,
            });
        }
        script.arg(before.generation).arg(before.frame);
        script.arg(commit.frame).arg(token);
        script.arg(milliseconds(commit.ttl));
        script.arg(if commit.takes_over { "1" } else { "" });
        Box::pin(self.0.connection.call(script))
    }

    fn check(
        &self,
        name: SessionName,
        version: Version,
        takes_over: bool,
        renew: Option<Duration>,
    ) -> StoreFuture<'_, Outcome> {
        let mut script = self.on(&self.0.scripts.check, name);
        script.arg(version.generation).arg(version.frame);
        script.arg(if takes_over { "1" } else { "" });
        if let Some(ttl) = renew {
            script.arg(milliseconds(ttl));
        }
        Box::pin(self.0.connection.call(script))
    }

    fn fence(&self, name: SessionName, version: Version) -> StoreFuture<'_, Outcome> {
        let mut script = self.on(&self.0.scripts.fence, name);
        script.arg(version.generation).arg(version.frame);
        Box::pin(self.0.connection.call(script))
    }

    fn end(&self, name: SessionName, ttl: Duration) -> StoreFuture<'_, bool> {
        let mut script = self.on(&self.0.scripts.end, name);
        script.arg(name.incarnation).arg(milliseconds(ttl));
        Box::pin(async move {
            let ended = self.0.connection.call(script).await?;
            // The session's client has room again. Its name is not known here, so all refused clients are checked
            // again.
            lock(&self.0.refused).clear();
            Ok(ended)
        })
    }

    fn secret(&self, new: [u8; 32]) -> StoreFuture<'_, [u8; 32]> {
        let key = format!("{}:secret", self.0.prefix);
        let mut script = self.0.scripts.secret.key(key);
        script.arg(&new[..]).arg(milliseconds(SECRET));
        Box::pin(async move {
            let secret: Vec<u8> = self.0.connection.call(script).await?;
            let secret = <[u8; 32]>::try_from(secret);
            secret.map_err(|_| StoreUnavailable("its secret is damaged".to_owned()))
        })
    }

    fn is_full(&self) -> bool {
        self.0.is_full.load(Ordering::Relaxed)
    }

    fn is_ready(&self) -> bool {
        self.0.connection.is_ready()
    }

    fn failures(&self) -> u64 {
        self.0.connection.failures()
    }
}

/// A random name for one write.
fn token() -> String {
    format!("{:016x}", random::<u64>())
}

impl std::fmt::Debug for RedisStore {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "RedisStore(ready: {})", self.is_ready())
    }
}
