//! A store whose calls and replies are on their way for as long as a test wants. They can be lost or done twice.

use crate::memory::Records;
use crate::records::Backend;
use bagtrack_sessions::{
    Commit, Outcome, Record, SessionName, SessionStore, StoreFuture, StoreUnavailable, Version,
};
use std::any::Any;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;
use tokio::sync::{Notify, oneshot};
use tokio::time::timeout;
use uuid::Uuid;

/// Longer than any request works.
const LONG: Duration = Duration::from_secs(60);

type Reply = Box<dyn Any + Send>;
type Script = Arc<dyn Fn(&mut dyn Backend) -> Reply + Send + Sync>;
type Sender = oneshot::Sender<Option<Reply>>;

/// A call on its way to the store.
pub struct Call {
    script: Script,
    /// `None` for a call that the connection sent again: nobody waits for its reply.
    sender: Option<Sender>,
    creates: bool,
}

struct Wire {
    records: Box<dyn Backend>,
    calls: Vec<Call>,
    replies: Vec<(Sender, Reply)>,
    /// Requests that neither wait for the store nor have ended.
    busy: usize,
    /// Whether each call is done and answered at once.
    is_quick: bool,
}

/// The store. Clones share its records and calls.
#[derive(Clone)]
pub struct HostileStore {
    wire: Arc<Mutex<Wire>>,
    idle: Arc<Notify>,
}

impl std::fmt::Debug for HostileStore {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("HostileStore")
    }
}

/// A request at work.
pub struct Busy(HostileStore);

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.wire().busy -= 1;
        self.0.idle.notify_one();
    }
}

impl HostileStore {
    /// A store with these records.
    pub fn new(records: impl Backend + 'static) -> Self {
        Self::with(records, false)
    }

    /// A store in memory that does each call at once.
    pub fn at_once() -> Self {
        Self::with(Records::default(), true)
    }

    fn with(records: impl Backend + 'static, is_quick: bool) -> Self {
        let wire = Wire {
            records: Box::new(records),
            calls: Vec::new(),
            replies: Vec::new(),
            busy: 0,
            is_quick,
        };
        Self {
            wire: Arc::new(Mutex::new(wire)),
            idle: Arc::default(),
        }
    }

    fn wire(&self) -> MutexGuard<'_, Wire> {
        self.wire.lock().unwrap()
    }

    pub fn begin(&self) -> Busy {
        self.wire().busy += 1;
        Busy(self.clone())
    }

    /// Waits until all requests wait for the store or have ended.
    pub async fn settles(&self) {
        while self.wire().busy > 0 {
            let idle = timeout(LONG, self.idle.notified()).await;
            idle.unwrap_or_else(|_| panic!("{} requests neither wait nor end", self.wire().busy));
        }
    }

    pub fn calls(&self) -> usize {
        self.wire().calls.len()
    }

    pub fn replies(&self) -> usize {
        self.wire().replies.len()
    }

    /// The store does a call.
    pub fn run(&self, pick: usize) {
        let mut wire = self.wire();
        let call = wire.calls.remove(pick);
        let reply = (call.script)(&mut *wire.records);
        wire.replies
            .extend(call.sender.map(|sender| (sender, reply)));
    }

    /// A reply arrives, or is lost: then the replica gives up.
    pub fn deliver(&self, pick: usize, arrives: bool) {
        let mut wire = self.wire();
        let (sender, reply) = wire.replies.remove(pick);
        wire.busy += 1;
        if sender.send(arrives.then_some(reply)).is_err() {
            // The request was given up.
            wire.busy -= 1;
        }
    }

    pub fn lose_call(&self, pick: usize) {
        let mut wire = self.wire();
        let Some(sender) = wire.calls.remove(pick).sender else {
            return;
        };
        wire.busy += 1;
        if sender.send(None).is_err() {
            wire.busy -= 1;
        }
    }

    /// Sends a call twice, where the store has a connection that may do that.
    pub fn repeat(&self, pick: usize) {
        let mut wire = self.wire();
        if !wire.records.knows_repeats() {
            return;
        }
        let Call {
            script, creates, ..
        } = &wire.calls[pick];
        let again = Call {
            script: script.clone(),
            sender: None,
            creates: *creates,
        };
        wire.calls.push(again);
    }

    pub fn forget(&self) {
        self.wire().records.forget();
        self.drop_creates();
    }

    /// The store ends, and begins again with what it has kept.
    pub fn restart(&self) {
        self.wire().records.restart();
    }

    pub fn has(&self, id: Uuid) -> bool {
        self.wire().records.load(id).is_some()
    }

    /// Drops the calls that create a record: none is on its way for so long that an existing record is lost or ended
    /// meanwhile.
    pub fn drop_creates(&self) {
        let mut wire = self.wire();
        let calls = wire.calls.drain(..);
        let (creates, others): (Vec<Call>, Vec<Call>) = calls.partition(|call| call.creates);
        wire.calls = others;
        for call in creates {
            if let Some(sender) = call.sender {
                wire.busy += 1;
                if sender.send(None).is_err() {
                    wire.busy -= 1;
                }
            }
        }
    }

    fn call<'a, T: Send + 'static>(
        &'a self,
        creates: bool,
        script: impl Fn(&mut dyn Backend) -> T + Send + Sync + 'static,
    ) -> StoreFuture<'a, T> {
        let (sender, reply) = oneshot::channel();
        Box::pin(async move {
            {
                let mut wire = self.wire();
                if wire.is_quick {
                    return Ok(script(&mut *wire.records));
                }
                let script: Script = Arc::new(move |records| Box::new(script(records)));
                let sender = Some(sender);
                wire.calls.push(Call {
                    script,
                    sender,
                    creates,
                });
                wire.busy -= 1;
            }
            self.idle.notify_one();
            let reply = Waiting { store: self, reply }.answer().await;
            let lost = StoreUnavailable("a test lost it".to_owned());
            let reply = reply.ok().flatten().ok_or(lost)?;
            Ok(*reply.downcast::<T>().expect("the reply to its own call"))
        })
    }
}

/// A request that waits for the store, and so is not busy. A request that is dropped while it waits counts as busy
/// again, until its `Busy` is dropped.
struct Waiting<'a> {
    store: &'a HostileStore,
    reply: oneshot::Receiver<Option<Reply>>,
}

impl Waiting<'_> {
    async fn answer(mut self) -> Result<Option<Reply>, oneshot::error::RecvError> {
        (&mut self.reply).await
    }
}

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        // `deliver` has made the request busy, whether the request has seen the reply or was given up before.
        self.reply.close();
        let is_delivered = self.reply.is_terminated() || self.reply.try_recv().is_ok();
        if !is_delivered {
            self.store.wire().busy += 1;
        }
    }
}

impl SessionStore for HostileStore {
    fn create<'a>(&'a self, id: Uuid, record: &'a Record) -> StoreFuture<'a, Outcome> {
        let (token, record) = (rand::random(), record.clone());
        self.call(true, move |records| records.create(token, id, &record))
    }

    fn load(&self, id: Uuid) -> StoreFuture<'_, Option<Record>> {
        self.call(false, move |records| records.load(id))
    }

    fn commit(&self, commit: Commit) -> StoreFuture<'_, Outcome> {
        let token = rand::random();
        self.call(false, move |records| records.commit(token, commit.clone()))
    }

    fn check(
        &self,
        name: SessionName,
        version: Version,
        takes_over: bool,
        _renew: Option<Duration>,
    ) -> StoreFuture<'_, Outcome> {
        self.call(false, move |records| {
            records.check(name, version, takes_over)
        })
    }

    fn fence(&self, name: SessionName, version: Version) -> StoreFuture<'_, Outcome> {
        self.call(false, move |records| records.fence(name, version))
    }

    fn end(&self, name: SessionName, _ttl: Duration) -> StoreFuture<'_, bool> {
        self.call(false, move |records| records.end(name))
    }

    fn secret(&self, new: [u8; 32]) -> StoreFuture<'_, [u8; 32]> {
        self.call(false, move |records| records.secret(new))
    }
}
