//! The connection to the store: calls that end in bounded time, and a probe that finds the store again.

use super::super::session_store::StoreUnavailable;
use super::address::{Kind, RedisAddress};
use super::script::{ScriptCall, ScriptServer};
use crate::clock::{self, sleep, timeout_at};
use redis::aio::{ConnectionManager, ConnectionManagerConfig};
use redis::cluster::ClusterConfig;
use redis::cluster_async::ClusterConnection;
use redis::{ErrorKind, FromRedisValue, RedisError, RedisResult, ServerErrorKind, Value};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Between two attempts of one call.
const PAUSE: Duration = Duration::from_millis(10);

/// What is sent to the store. It can be sent again.
pub(super) enum Call<'a> {
    Script(ScriptCall<'a>),
    Ping,
}

impl Call<'_> {
    async fn send(&self, link: &mut Link) -> RedisResult<Value> {
        match (self, link) {
            (Self::Script(script), Link::Server(link)) => script.invoke(link).await,
            (Self::Script(script), Link::Cluster(link)) => script.invoke(link).await,
            (Self::Script(script), Link::Given(server)) => script.run_at(server.as_ref()).await,
            (Self::Ping, Link::Server(link)) => redis::cmd("PING").query_async(link).await,
            (Self::Ping, Link::Cluster(link)) => redis::cmd("PING").query_async(link).await,
            (Self::Ping, Link::Given(server)) => server.ping().await,
        }
    }
}

/// A connection that finds its way back by itself. Clones share it.
#[derive(Clone)]
pub(super) enum Link {
    Server(ConnectionManager),
    Cluster(ClusterConnection),
    Given(Arc<dyn ScriptServer>),
}

/// The connection, and whether the store answers.
pub(super) struct Connection {
    address: RedisAddress,
    timeout: Duration,
    /// With the number of links before it.
    link: Mutex<(u64, Link)>,
    is_up: AtomicBool,
    /// Whether the store refused the last write of a probe.
    refuses: AtomicBool,
    /// Whether the next probe is a write: at the start, and after a call was refused.
    is_doubtful: AtomicBool,
    failures: AtomicU64,
}

impl Link {
    fn new(address: &RedisAddress, timeout: Duration) -> RedisResult<Self> {
        match &address.0 {
            Kind::Server(client) => {
                let config = ConnectionManagerConfig::new()
                    .set_number_of_retries(1)
                    .set_min_delay(PAUSE)
                    .set_connection_timeout(Some(timeout))
                    .set_response_timeout(Some(timeout));
                let client = client.as_ref().clone();
                ConnectionManager::new_lazy_with_config(client, config).map(Self::Server)
            }
            Kind::Cluster(client) => {
                let config = ClusterConfig::new();
                let link = client.get_pending_async_connection_with_config(config);
                Ok(Self::Cluster(link))
            }
            Kind::Given(server) => Ok(Self::Given(server.clone())),
        }
    }
}

impl Connection {
    /// To the store at this address, whose calls end after `timeout`. Nothing is sent yet.
    pub(super) fn new(address: RedisAddress, timeout: Duration) -> RedisResult<Self> {
        let link = Link::new(&address, timeout)?;
        Ok(Self {
            address,
            timeout,
            link: Mutex::new((0, link)),
            is_up: AtomicBool::new(true),
            refuses: AtomicBool::new(false),
            is_doubtful: AtomicBool::new(true),
            failures: AtomicU64::new(0),
        })
    }

    /// Whether the last call got an answer, and the last probe found that the store takes writes.
    pub(super) fn is_ready(&self) -> bool {
        self.is_up() && !self.refuses.load(Ordering::Acquire)
    }

    /// Whether the last call got an answer, a refusal too.
    fn is_up(&self) -> bool {
        self.is_up.load(Ordering::Acquire)
    }

    /// How many calls got no answer, or were refused.
    pub(super) fn failures(&self) -> u64 {
        self.failures.load(Ordering::Relaxed)
    }

    /// Calls the store, again and again until it answers or the time is over. A store that did not answer lately is not
    /// called.
    ///
    /// # Errors
    /// There is no answer.
    pub(super) async fn call<T: FromRedisValue>(
        &self,
        call: Call<'_>,
    ) -> Result<T, StoreUnavailable> {
        if !self.is_up() {
            self.failures.fetch_add(1, Ordering::Relaxed);
            return Err(StoreUnavailable("it did not answer lately".to_owned()));
        }
        let value = self.attempt(call).await?;
        T::from_redis_value(value).map_err(|error| StoreUnavailable(error.to_string()))
    }

    async fn attempt(&self, call: Call<'_>) -> Result<Value, StoreUnavailable> {
        let deadline = clock::now() + self.timeout;
        let mut reason: Option<RedisError> = None;
        while clock::now() < deadline {
            let (number, mut link) = self.lock().clone();
            match timeout_at(deadline, call.send(&mut link)).await {
                Ok(Ok(value)) => {
                    self.answers();
                    return Ok(value);
                }
                // It answers, but will not do this, however often it is asked.
                Ok(Err(error)) if is_refusal(&error) => {
                    self.answers();
                    self.is_doubtful.store(true, Ordering::Release);
                    self.failures.fetch_add(1, Ordering::Relaxed);
                    if !self.refuses.load(Ordering::Acquire) {
                        tracing::error!(%error, "the store refuses a call");
                    }
                    return Err(StoreUnavailable(error.to_string()));
                }
                // A connection over which nothing comes may be dead without knowing it.
                Ok(Err(error)) if error.is_timeout() => {
                    reason = Some(error);
                    self.replace(number);
                }
                Ok(Err(error)) => reason = Some(error),
                Err(_) => self.replace(number),
            }
            sleep(PAUSE).await;
        }
        self.failures.fetch_add(1, Ordering::Relaxed);
        let reason = reason.map_or_else(|| "time is over".to_owned(), |error| error.to_string());
        if self.is_up.swap(false, Ordering::AcqRel) {
            tracing::error!(reason, "the store gives no answer");
        }
        Err(StoreUnavailable(reason))
    }

    fn answers(&self) {
        if !self.is_up.swap(true, Ordering::AcqRel) {
            tracing::info!("the store answers again");
        }
    }

    /// Makes another link in place of the one of this number.
    fn replace(&self, number: u64) {
        let mut link = self.lock();
        if link.0 == number
            && let Ok(new) = Link::new(&self.address, self.timeout)
        {
            *link = (number + 1, new);
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, (u64, Link)> {
        // Nothing panics while it is held.
        self.link.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Asks the store whether it is there; with this write, where it may not take any.
    pub(super) async fn probe(&self, write: Call<'_>) {
        let (number, _) = *self.lock();
        let is_doubtful = self.is_doubtful.swap(false, Ordering::AcqRel);
        let is_write = is_doubtful || !self.is_ready();
        let probed = self
            .attempt(if is_write { write } else { Call::Ping })
            .await;
        if is_write {
            let has_refused = self.refuses.swap(probed.is_err(), Ordering::AcqRel);
            if has_refused && probed.is_ok() {
                tracing::info!("the store takes writes again");
            }
        }
        if probed.is_err() {
            // A link that was refused while it was made, as with a wrong password, is not made anew by itself.
            self.replace(number);
        }
    }
}

/// Whether the store refuses a call for good: it has no memory left, say.
fn is_refusal(error: &RedisError) -> bool {
    use ServerErrorKind::{BusyLoading, ClusterDown, MasterDown, ReadOnly, TryAgain};
    match error.kind() {
        ErrorKind::Server(BusyLoading | ClusterDown | MasterDown | ReadOnly | TryAgain) => false,
        ErrorKind::Server(_) | ErrorKind::Extension => true,
        _ => false,
    }
}
