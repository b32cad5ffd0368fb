//! The open connections: how many there are, whose they are, and which one makes room for a new one.
//!
//! A client is an IPv4 address or an IPv6 network of 64 bits. A client has at most its maximum of connections, and at
//! most as many as are free or idle (a dynamic threshold, as in [`Budget`](bagtrack_sessions::Budget)): so a few
//! clients with busy connections leave some to each further client. The wider IPv6 networks that a client is in may
//! hold as many as one client, and beyond that as many as are free or idle.
//!
//! A client that may have no more loses its own connection that was idle longest. When all connections are taken, the
//! client with the most connections that has an idle one loses its longest idle one. A connection with a request in
//! progress is never closed for another one.
//!
//! Each connection has a [hold](ConnectionHold) on its place until it ends: HTTP has it first, then perhaps a stream
//! that takes the connection over.

use super::activity::Activity;
use super::client_address::{customer_address, wider_networks};
use super::connection_io::ConnectionIo;
use axum::body::Body;
use hyper::body::Incoming;
use hyper::server::conn::http1::UpgradeableConnection;
use hyper::service::HttpService;
use hyper_util::rt::TokioIo;
use ipnet::Ipv6Net;
use metrics::Counter;
use std::cmp::Reverse;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::error::Error;
use std::net::IpAddr;
use std::pin::pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::{Notify, watch};

/// Why there is no room for a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoRoom {
    /// All connections that the address may have are busy.
    Address,
    /// All connections are busy.
    All,
}

/// The open connections.
#[derive(Debug)]
pub struct Connections {
    max: usize,
    max_of_address: usize,
    open: Mutex<Open>,
    /// Notified when a connection has ended or has become idle.
    pub freed: Arc<Notify>,
    /// Counts connections that were closed for others.
    shed: Counter,
}

#[derive(Debug, Default)]
struct Open {
    next: u64,
    connections: HashMap<u64, (IpAddr, Arc<Activity>)>,
    counts: HashMap<Holder, usize>,
}

/// A client or a network, whose connections are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Holder {
    /// A client, by its [`customer_address`].
    Client(IpAddr),
    Network(Ipv6Net),
}

impl Holder {
    /// The client, and the networks that it is in.
    fn all_of(client: IpAddr) -> impl Iterator<Item = Self> {
        let networks = wider_networks(client).map(Self::Network);
        std::iter::once(Self::Client(client)).chain(networks)
    }
}

/// A place for a connection, given back when this is dropped.
#[derive(Debug)]
pub struct ConnectionPermit {
    connections: Arc<Connections>,
    number: u64,
    /// What the connection is doing.
    pub activity: Arc<Activity>,
}

impl Connections {
    /// At most `max` connections together and `max_of_address` of one client. `shed` counts those that are closed for
    /// others.
    pub fn new(max: usize, max_of_address: usize, shed: Counter) -> Arc<Self> {
        Arc::new(Self {
            max,
            max_of_address,
            open: Mutex::default(),
            freed: Arc::default(),
            shed,
        })
    }

    /// Takes a place for a connection from `address`, which is `shared` if it is that of a proxy with many clients.
    ///
    /// # Errors
    /// There is no place, and no idle connection to close for it.
    pub fn enter(
        self: &Arc<Self>,
        address: IpAddr,
        shared: bool,
    ) -> Result<ConnectionPermit, NoRoom> {
        let client = customer_address(address);
        let mut open = self.open();
        let free = self.max.saturating_sub(open.connections.len());
        let has_share = shared
            || self.leaves_room(&open, client, free)
            || self.leaves_room(&open, client, free + open.idle());
        if !has_share {
            let shed = open.shed(|other| other == client);
            shed.ok_or(NoRoom::Address)?;
            self.shed.increment(1);
        } else if free == 0 {
            open.shed(|_| true).ok_or(NoRoom::All)?;
            self.shed.increment(1);
        }
        Ok(self.admit(&mut open, client))
    }

    fn admit(self: &Arc<Self>, open: &mut Open, client: IpAddr) -> ConnectionPermit {
        let number = open.next;
        open.next += 1;
        let activity = Activity::new(self.freed.clone());
        for holder in Holder::all_of(client) {
            *open.counts.entry(holder).or_default() += 1;
        }
        open.connections.insert(number, (client, activity.clone()));
        ConnectionPermit {
            connections: self.clone(),
            number,
            activity,
        }
    }

    /// Whether a client may have one more connection where `free` are free.
    fn leaves_room(&self, open: &Open, client: IpAddr, free: usize) -> bool {
        let is_alone = open.count(&Holder::Client(client)) == open.connections.len();
        Holder::all_of(client).all(|holder| {
            let most = match holder {
                // A client that alone has connections may have all that is free.
                Holder::Client(_) if is_alone => self.max_of_address,
                Holder::Client(_) => self.max_of_address.min(free),
                Holder::Network(_) => self.max_of_address.max(free),
            };
            open.count(&holder) < most
        })
    }

    fn open(&self) -> MutexGuard<'_, Open> {
        // Nothing panics while the lock is held.
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Open {
    fn count(&self, holder: &Holder) -> usize {
        self.counts.get(holder).copied().unwrap_or(0)
    }

    fn idle(&self) -> usize {
        let activities = self.connections.values();
        let idle = activities.filter(|(_, activity)| activity.idle_since().is_some());
        idle.count()
    }

    /// Closes an idle connection of the clients that `of` accepts, if there is one: of the client with the most
    /// connections, the one that was idle longest.
    fn shed(&mut self, of: impl Fn(IpAddr) -> bool) -> Option<()> {
        let idle = self
            .connections
            .iter()
            .filter_map(|(number, (client, activity))| {
                let since = activity.idle_since().filter(|_| of(*client))?;
                let count = self.count(&Holder::Client(*client));
                Some((count, Reverse((since, *number))))
            });
        let (_, Reverse((_, number))) = idle.max()?;
        self.remove(number)?.shed.notify_one();
        Some(())
    }

    fn remove(&mut self, number: u64) -> Option<Arc<Activity>> {
        let (client, activity) = self.connections.remove(&number)?;
        for holder in Holder::all_of(client) {
            if let Entry::Occupied(mut count) = self.counts.entry(holder) {
                *count.get_mut() -= 1;
                if *count.get() == 0 {
                    count.remove();
                }
            }
        }
        Some(activity)
    }
}

impl Drop for ConnectionPermit {
    fn drop(&mut self) {
        self.connections.open().remove(self.number);
        self.connections.freed.notify_one();
    }
}

/// A connection's place among the open ones, and how it learns that it is to end. Clones are the same connection.
#[derive(Debug, Clone)]
pub struct ConnectionHold {
    permit: Arc<ConnectionPermit>,
    ending: watch::Receiver<bool>,
    cut_off: watch::Receiver<()>,
}

impl ConnectionHold {
    /// The hold of a connection that ends in order when `ending` turns true, and at once when `cut_off` loses its
    /// sender.
    pub fn new(
        permit: ConnectionPermit,
        ending: watch::Receiver<bool>,
        cut_off: watch::Receiver<()>,
    ) -> Self {
        Self {
            permit: Arc::new(permit),
            ending,
            cut_off,
        }
    }

    /// What the connection is doing.
    pub fn activity(&self) -> &Arc<Activity> {
        &self.permit.activity
    }

    /// Waits until the service asks its connections to end.
    pub async fn ending(&mut self) {
        // Without the sender the service has ended, too.
        let _ = self.ending.wait_for(|ending| *ending).await;
    }

    /// Waits until the connection is cut off.
    pub async fn cut_off(&mut self) {
        while self.cut_off.changed().await.is_ok() {}
    }

    /// The output of `beginning`, unless the connection has to end before.
    pub async fn begin<T>(&mut self, beginning: impl Future<Output = T>) -> Option<T> {
        let activity = self.activity().clone();
        let mut cut_off = self.clone();
        tokio::select! {
            biased;
            () = cut_off.cut_off() => None,
            () = self.ending() => None,
            () = activity.shed.notified() => None,
            begun = beginning => Some(begun),
        }
    }

    /// Serves HTTP until the connection ends, or a stream has taken it over.
    pub async fn serve<S>(mut self, connection: UpgradeableConnection<TokioIo<ConnectionIo>, S>)
    where
        S: HttpService<Incoming, ResBody = Body>,
        S::Error: Into<Box<dyn Error + Send + Sync>>,
    {
        let activity = self.activity().clone();
        let mut connection = pin!(connection);
        let mut cut_off = self.clone();
        let mut asked = false;
        loop {
            tokio::select! {
                biased;
                () = cut_off.cut_off() => return tracing::warn!("connection cut off"),
                () = self.ending(), if !asked => {
                    asked = true;
                    connection.as_mut().graceful_shutdown();
                }
                () = activity.shed.notified() => {
                    return tracing::debug!("idle connection closed for another");
                }
                result = &mut connection => {
                    if let Err(error) = result {
                        tracing::debug!(%error, "connection ended");
                    }
                    return;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::body::Body;

    #[test]
    fn the_address_with_most_connections_loses_the_one_that_was_idle_longest() {
        let connections = Connections::new(4, 3, Counter::noop());
        let address = |last: u8| IpAddr::from([192, 0, 2, last]);
        let enter = |last: u8| connections.enter(address(last), false);
        let busy = enter(1).unwrap();
        // The client has begun to send a body.
        let never = futures_util::stream::pending::<Result<Vec<u8>, std::io::Error>>();
        let _body = busy.activity.receive(Body::from_stream(never));
        let idle = [enter(1).unwrap(), enter(1).unwrap(), enter(2).unwrap()];
        let _other = enter(3).unwrap();
        let numbers = || {
            let mut numbers: Vec<u64> = connections.open().connections.keys().copied().collect();
            numbers.sort_unstable();
            numbers
        };
        assert_eq!(numbers().len(), 4);
        assert!(numbers().contains(&busy.number) && numbers().contains(&idle[2].number));
        let _fourth = enter(1).unwrap();
        let _fifth = enter(1).unwrap();
        // Two idle connections of the same client were closed for them.
        let first = Holder::Client(address(1));
        assert_eq!(connections.open().count(&first), 2);
        drop(idle);
        assert!(numbers().contains(&busy.number), "a busy one is not closed");
    }

    #[test]
    fn the_addresses_of_one_network_share_what_is_free() {
        let connections = Connections::new(32, 8, Counter::noop());
        let held: Vec<ConnectionPermit> = (0..100)
            .filter_map(|number: u16| {
                let address = IpAddr::from([0x2001, 0xdb8, 1, number, 0, 0, 0, 1]);
                let permit = connections.enter(address, false).ok()?;
                let never = futures_util::stream::pending::<Result<Vec<u8>, std::io::Error>>();
                // Its body never ends, so it is never idle.
                std::mem::forget(permit.activity.receive(Body::from_stream(never)));
                Some(permit)
            })
            .collect();
        assert_eq!(held.len(), 16);
        let other = IpAddr::from([0x2001, 0xdb8, 2, 0, 0, 0, 0, 1]);
        assert!(connections.enter(other, false).is_ok());
    }
}
