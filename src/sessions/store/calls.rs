//! The calls to the store.

use super::address::StoreAddress;
use super::connection::{Call, Connection, StoreAway};
use super::record::{Fields, Record, SessionName, Version};
use super::scripts::Scripts;
use crate::sessions::owner::Owner;
use redis::{FromRedisValue, Script, ScriptInvocation};
use std::sync::{Arc, Weak};
use std::time::Duration;
use tokio::time::sleep;
use uuid::Uuid;

/// How long an idempotency key names its session.
const CLAIMED: Duration = Duration::from_secs(24 * 3600);
/// How often the store is asked whether it is there.
const PROBE: Duration = Duration::from_millis(250);

/// What the store says to a call about a record.
#[derive(Debug, Clone, PartialEq)]
pub enum Reply {
    /// There is no such record. The store has lost it, if the session lives.
    Missing,
    /// The session was ended.
    Ended,
    /// It was done, or the version is the newest. The record lives as long as this without a frame.
    Done(Duration),
    /// The record has another version; nothing was written.
    Other(Box<Record>),
}

/// The store. Clones are the same store.
#[derive(Clone)]
pub struct Store(Arc<Shared>);

struct Shared {
    connection: Connection,
    scripts: Scripts,
    prefix: String,
}

impl Shared {
    async fn probe(&self) {
        let key = format!("{}:probe", self.prefix);
        let write = self.scripts.probe.key(key);
        self.connection.probe(Call::Script(write)).await;
    }
}

/// Finds out whether the store is there, as long as somebody uses it.
async fn probe(store: Weak<Shared>) {
    while let Some(store) = store.upgrade() {
        store.probe().await;
        drop(store);
        sleep(PROBE).await;
    }
}

/// What scripts answer.
struct Answer(Reply);

impl FromRedisValue for Answer {
    fn from_redis_value(value: redis::Value) -> Result<Self, redis::ParsingError> {
        let parts: Vec<redis::Value> = FromRedisValue::from_redis_value(value)?;
        let mut parts = parts.into_iter();
        let mut next = || parts.next().ok_or("too few values");
        let reply = match i64::from_redis_value(next()?)? {
            0 => Reply::Missing,
            3 => Reply::Ended,
            kind => {
                let lives = i64::from_redis_value(next()?)?;
                let lives = Duration::from_millis(u64::try_from(lives).unwrap_or(0));
                match kind {
                    1 => Reply::Done(lives),
                    _ => {
                        let fields = Fields::from_redis_value(next()?)?;
                        let record = Record::read(fields, lives);
                        Reply::Other(Box::new(record.ok_or("another version wrote it")?))
                    }
                }
            }
        };
        Ok(Self(reply))
    }
}

impl Store {
    /// The store at this address. The keys of its records begin with `prefix`. Calls end after `timeout`. It waits for
    /// the first answer, and goes on without one.
    ///
    /// # Errors
    /// The address cannot be used.
    pub async fn connect(
        address: StoreAddress,
        prefix: &str,
        timeout: Duration,
    ) -> Result<Self, StoreAway> {
        let connection = Connection::new(address, timeout);
        let connection = connection.map_err(|error| StoreAway::because(&error))?;
        let shared = Arc::new(Shared {
            connection,
            scripts: Scripts::new(),
            prefix: prefix.to_owned(),
        });
        shared.probe().await;
        tokio::spawn(probe(Arc::downgrade(&shared)));
        Ok(Self(shared))
    }

    /// Whether the store answers and takes writes.
    pub fn is_ready(&self) -> bool {
        self.0.connection.is_ready()
    }

    /// How many calls got no answer or were refused since the start.
    pub fn failures(&self) -> u64 {
        self.0.connection.failures()
    }

    async fn about_record(&self, script: ScriptInvocation<'_>) -> Result<Reply, StoreAway> {
        let Answer(reply) = self.0.connection.call(Call::Script(script)).await?;
        Ok(reply)
    }

    /// Of a record. Braces make a cluster keep the keys of a session at one node.
    fn key(&self, id: Uuid) -> String {
        format!("{}:session:{{{id}}}", self.0.prefix)
    }

    /// Runs a script on a session.
    fn on<'a>(&self, script: &'a Script, name: SessionName) -> ScriptInvocation<'a> {
        let SessionName { id, birth } = name;
        let mut invocation = script.key(self.key(id));
        invocation.key(format!("{}:ended:{{{id}}}:{birth:016x}", self.0.prefix));
        invocation
    }

    /// Adds the record of the session with this id. [`Reply::Other`] where there is one.
    ///
    /// # Errors
    /// The store gives no answer.
    pub async fn create(&self, id: Uuid, record: &Record) -> Result<Reply, StoreAway> {
        let (version, token, birth) = (record.version, token(), record.opening.birth);
        let head = Record::head(&record.owner, &record.opening);
        let mut script = self.on(&self.0.scripts.create, SessionName { id, birth });
        script.arg(version.generation).arg(version.frame).arg(token);
        script.arg(birth).arg(&head[..]).arg(&record.state[..]);
        script.arg(milliseconds(record.lives));
        self.about_record(script).await
    }

    /// Moves a record from `before` to the frame `to`, with the state where it is given. `goes_on` says that this replica
    /// goes on with the session from what it gets, where the record has another version.
    ///
    /// # Errors
    /// The store gives no answer. It may have done it nevertheless.
    pub async fn advance(
        &self,
        name: SessionName,
        before: Version,
        to: u64,
        state: Option<&[u8]>,
        goes_on: bool,
        lives: Duration,
    ) -> Result<Reply, StoreAway> {
        let mut script = self.on(&self.0.scripts.advance, name);
        script.arg(before.generation).arg(before.frame).arg(to);
        script.arg(token()).arg(milliseconds(lives));
        script.arg(if goes_on { "1" } else { "" });
        if let Some(state) = state {
            script.arg(state);
        }
        self.about_record(script).await
    }

    /// Asks whether this version is the newest. `goes_on` says that this replica goes on with the session from what it
    /// gets. `lives` renews the record's time to live.
    ///
    /// # Errors
    /// The store gives no answer.
    pub async fn check(
        &self,
        name: SessionName,
        version: Version,
        goes_on: bool,
        lives: Option<Duration>,
    ) -> Result<Reply, StoreAway> {
        let mut script = self.on(&self.0.scripts.check, name);
        script.arg(version.generation).arg(version.frame);
        script.arg(if goes_on { "1" } else { "" });
        if let Some(lives) = lives {
            script.arg(milliseconds(lives));
        }
        self.about_record(script).await
    }

    /// Begins the next generation of a record, if this version is the newest: no other replica then goes on from its own
    /// copy.
    ///
    /// # Errors
    /// The store gives no answer. It may have done it nevertheless.
    pub async fn fence(&self, name: SessionName, version: Version) -> Result<Reply, StoreAway> {
        let mut script = self.on(&self.0.scripts.fence, name);
        script.arg(version.generation).arg(version.frame);
        self.about_record(script).await
    }

    /// The record of a session, if there is one.
    ///
    /// # Errors
    /// The store gives no answer.
    pub async fn load(&self, id: Uuid) -> Result<Option<Record>, StoreAway> {
        let mut script = self.0.scripts.check.key(self.key(id));
        // Whether a session was ended does not matter, and no record has this version.
        script.key(self.key(id));
        script.arg("").arg("").arg("");
        Ok(match self.about_record(script).await? {
            Reply::Other(record) => Some(*record),
            Reply::Missing | Reply::Ended | Reply::Done(_) => None,
        })
    }

    /// Ends a session: no replica brings its record back within `lives`, the time that a copy may live. False where it had
    /// ended before.
    ///
    /// # Errors
    /// The store gives no answer.
    pub async fn end(&self, name: SessionName, lives: Duration) -> Result<bool, StoreAway> {
        let mut script = self.on(&self.0.scripts.end, name);
        script.arg(name.birth).arg(milliseconds(lives));
        self.0.connection.call(Call::Script(script)).await
    }

    /// The id that an owner's idempotency key names: `id`, if it names none yet.
    ///
    /// # Errors
    /// The store gives no answer.
    pub async fn claim(&self, owner: &Owner, key: &str, id: Uuid) -> Result<Uuid, StoreAway> {
        let name = blake3::hash(format!("{:?} {key}", owner.name()).as_bytes()).to_hex();
        let name = format!("{}:key:{name}", self.0.prefix);
        let mut script = self.0.scripts.claim.key(&name);
        script.arg(id.to_string()).arg(milliseconds(CLAIMED));
        let claimed: String = self.0.connection.call(Call::Script(script)).await?;
        Ok(claimed.parse().unwrap_or(id))
    }
}

/// A name for one write.
fn token() -> String {
    format!("{:016x}", rand::random::<u64>())
}

fn milliseconds(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX).max(1)
}

impl std::fmt::Debug for Store {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "Store(ready: {})", self.is_ready())
    }
}
