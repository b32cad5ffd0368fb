//! The calls to the store.

use super::address::StoreAddress;
use super::connection::{Call, Connection, StoreAway};
use super::record::{Fields, Record, Version};
use super::scripts::Scripts;
use crate::sessions::owner::Owner;
use redis::{FromRedisValue, ScriptInvocation};
use std::sync::Arc;
use std::time::Duration;
use uuid::Uuid;

/// How long an idempotency key names its session.
const CLAIMED: Duration = Duration::from_secs(24 * 3600);

/// What the store says to a call about a record.
#[derive(Debug, Clone, PartialEq)]
pub enum Reply {
    /// There is no such record.
    Gone,
    /// It was done, or the version is the newest. The record lives as long as this without a frame.
    Done(Duration),
    /// The record has another version; nothing was written.
    Other(Box<Record>),
}

/// The store. Clones are the same store.
#[derive(Clone)]
pub struct Store(Arc<Shared>);

struct Shared {
    connection: Arc<Connection>,
    scripts: Scripts,
    prefix: String,
}

/// What scripts answer.
struct Answer(Reply);

impl FromRedisValue for Answer {
    fn from_redis_value(value: redis::Value) -> Result<Self, redis::ParsingError> {
        let parts: Vec<redis::Value> = FromRedisValue::from_redis_value(value)?;
        let mut parts = parts.into_iter();
        let mut next = || parts.next().ok_or("too few values");
        let reply = match i64::from_redis_value(next()?)? {
            0 => Reply::Gone,
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
        let _ = connection.ping().await;
        Ok(Self(Arc::new(Shared {
            connection,
            scripts: Scripts::new(),
            prefix: prefix.to_owned(),
        })))
    }

    /// Whether the store answers.
    pub fn is_up(&self) -> bool {
        self.0.connection.is_up()
    }

    /// How many calls got no answer since the start.
    pub fn failures(&self) -> u64 {
        self.0.connection.failures()
    }

    async fn about_record(&self, script: ScriptInvocation<'_>) -> Result<Reply, StoreAway> {
        let Answer(reply) = self.0.connection.call(Call::Script(script)).await?;
        Ok(reply)
    }

    fn key(&self, id: Uuid) -> String {
        format!("{}:session:{id}", self.0.prefix)
    }

    /// Adds the record of a session. [`Reply::Other`] where its id is taken.
    ///
    /// # Errors
    /// The store gives no answer.
    pub async fn create(&self, id: Uuid, record: &Record) -> Result<Reply, StoreAway> {
        let (version, token) = (record.version, token());
        let head = Record::head(&record.owner, &record.opening);
        let mut script = self.0.scripts.create.key(self.key(id));
        script.arg(version.generation).arg(version.frame).arg(token);
        script.arg(&head[..]).arg(&record.state[..]);
        script.arg(milliseconds(record.lives));
        self.about_record(script).await
    }

    /// Moves a record from `before` to the frame `to`, with the state where it is given.
    ///
    /// # Errors
    /// The store gives no answer. It may have done it nevertheless.
    pub async fn advance(
        &self,
        id: Uuid,
        before: Version,
        to: u64,
        state: Option<&[u8]>,
        lives: Duration,
    ) -> Result<Reply, StoreAway> {
        let mut script = self.0.scripts.advance.key(self.key(id));
        script.arg(before.generation).arg(before.frame).arg(to);
        script.arg(token()).arg(milliseconds(lives));
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
        id: Uuid,
        version: Version,
        goes_on: bool,
        lives: Option<Duration>,
    ) -> Result<Reply, StoreAway> {
        let mut script = self.0.scripts.check.key(self.key(id));
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
    pub async fn fence(&self, id: Uuid, version: Version) -> Result<Reply, StoreAway> {
        let mut script = self.0.scripts.fence.key(self.key(id));
        script.arg(version.generation).arg(version.frame);
        self.about_record(script).await
    }

    /// The record of a session, if there is one.
    ///
    /// # Errors
    /// The store gives no answer.
    pub async fn load(&self, id: Uuid) -> Result<Option<Record>, StoreAway> {
        let mut script = self.0.scripts.check.key(self.key(id));
        // No record has these.
        script.arg("").arg("").arg("");
        Ok(match self.about_record(script).await? {
            Reply::Other(record) => Some(*record),
            Reply::Gone | Reply::Done(_) => None,
        })
    }

    /// Removes the record of a session.
    ///
    /// # Errors
    /// The store gives no answer.
    pub async fn remove(&self, id: Uuid) -> Result<(), StoreAway> {
        let mut command = redis::cmd("DEL");
        command.arg(self.key(id));
        self.0.connection.call(Call::Command(command)).await
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
        write!(formatter, "Store(up: {})", self.is_up())
    }
}
