//! The connection to the store: calls that end in bounded time, and a probe that finds the store again.

use super::super::session_store::StoreUnavailable;
use super::address::{Kind, RedisAddress};
use super::scripts::{ScriptCall, ScriptServer};
use crate::clock::{self, sleep, timeout_at};
use crate::sync::{Mutex, lock};
use redis::aio::{ConnectionManager, ConnectionManagerConfig};
use redis::cluster::ClusterConfig;
use redis::cluster_async::ClusterConnection;
use redis::{ErrorKind, FromRedisValue, RedisError, RedisResult, ServerErrorKind, Value};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

/// Time between two attempts of one call.
const PAUSE: Duration = Duration::from_millis(10);

/// A connection that connects again by itself. Clones share it.
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
    /// The link, with the number of links before it.
    link: Mutex<(u64, Link)>,
    is_up: AtomicBool,
    /// Whether the store refused the last write of a probe.
    refuses: AtomicBool,
    failures: AtomicU64,
}

impl Link {
    async fn send(&mut self, script: &ScriptCall<'_>) -> RedisResult<Value> {
        match self {
            Self::Server(link) => script.invoke(link).await,
            Self::Cluster(link) => script.invoke(link).await,
            Self::Given(server) => script.run_at(server.as_ref()).await,
        }
    }

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
    /// A connection to the store at this address, whose calls end after `timeout`. Nothing is sent yet.
    pub(super) fn new(address: RedisAddress, timeout: Duration) -> RedisResult<Self> {
        let link = Link::new(&address, timeout)?;
        Ok(Self {
            address,
            timeout,
            link: Mutex::new((0, link)),
            is_up: AtomicBool::new(true),
            refuses: AtomicBool::new(false),
            failures: AtomicU64::new(0),
        })
    }

    /// Whether the last call got an answer, and the last probe found that the store takes writes.
    pub(super) fn is_ready(&self) -> bool {
        self.is_up() && !self.refuses.load(Ordering::Acquire)
    }

    /// Whether the last call got an answer; a refusal is one.
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
    /// The store gives no answer in time, refuses the call, or answers something else than a `T`.
    pub(super) async fn call<T: FromRedisValue>(
        &self,
        script: ScriptCall<'_>,
    ) -> Result<T, StoreUnavailable> {
        if !self.is_up() {
            self.failures.fetch_add(1, Ordering::Relaxed);
            return Err(StoreUnavailable("it did not answer lately".to_owned()));
        }
        let value = self.attempt(&script).await?;
        T::from_redis_value(value).map_err(|error| StoreUnavailable(error.to_string()))
    }

    async fn attempt(&self, script: &ScriptCall<'_>) -> Result<Value, StoreUnavailable> {
        let deadline = clock::now() + self.timeout;
        let mut reason: Option<RedisError> = None;
        while clock::now() < deadline {
            let (number, mut link) = lock(&self.link).clone();
            match timeout_at(deadline, link.send(script)).await {
                Ok(Ok(value)) => {
                    self.answers();
                    return Ok(value);
                }
                // The store answers, but refuses this call however often it is sent.
                Ok(Err(error)) if is_refusal(&error) => {
                    self.answers();
                    self.failures.fetch_add(1, Ordering::Relaxed);
                    if !self.refuses.load(Ordering::Acquire) {
                        tracing::error!(%error, "the store refuses a call");
                    }
                    return Err(StoreUnavailable(error.to_string()));
                }
                // A connection over which nothing comes may be dead without an error.
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
        let mut link = lock(&self.link);
        if link.0 == number
            && let Ok(new) = Link::new(&self.address, self.timeout)
        {
            *link = (number + 1, new);
        }
    }

    /// Asks the store whether it is there and takes this write.
    ///
    /// # Errors
    /// The store gives no answer, or refuses the write.
    pub(super) async fn probe<T: FromRedisValue>(
        &self,
        write: ScriptCall<'_>,
    ) -> Result<T, StoreUnavailable> {
        let (number, _) = *lock(&self.link);
        let probed = self.attempt(&write).await;
        let has_refused = self.refuses.swap(probed.is_err(), Ordering::AcqRel);
        if has_refused && probed.is_ok() {
            tracing::info!("the store takes writes again");
        }
        if probed.is_err() {
            // A link that was refused while it was made, as with a wrong password, is not made anew by itself.
            self.replace(number);
        }
        T::from_redis_value(probed?).map_err(|error| StoreUnavailable(error.to_string()))
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
