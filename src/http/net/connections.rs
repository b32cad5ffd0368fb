//! The open connections: how many there are, whose they are, and which one makes room for a new one.
//!
//! When all are taken, or all of one address, the one that was idle longest is closed; of several addresses, one of the
//! address that has most. A connection with a request in progress is never closed for another one.

use super::activity::Activity;
use crate::http::quotas::client::Client;
use metrics::Counter;
use std::cmp::Reverse;
use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;

/// Why there is no room for a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoRoom {
    /// All connections of the address are busy.
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
    /// Told when one has ended.
    pub ended: Notify,
    /// Counts those that were closed for others.
    shed: Counter,
}

#[derive(Debug, Default)]
struct Open {
    next: u64,
    connections: HashMap<u64, (Client, Arc<Activity>)>,
    counts: HashMap<Client, usize>,
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
    /// At most `max` together and `max_of_address` of one address. `shed` counts those that are closed for others.
    pub fn new(max: usize, max_of_address: usize, shed: Counter) -> Arc<Self> {
        Arc::new(Self {
            max,
            max_of_address,
            open: Mutex::default(),
            ended: Notify::new(),
            shed,
        })
    }

    /// Takes a place for a connection from `address`. One that is `shared` is a proxy's, which many clients use.
    ///
    /// # Errors
    /// There is no place, and no idle connection to close for it.
    pub fn enter(
        self: &Arc<Self>,
        address: IpAddr,
        shared: bool,
    ) -> Result<ConnectionPermit, NoRoom> {
        let client = Client::at(address);
        let mut open = self.open();
        let of_address = open.counts.get(&client).copied().unwrap_or(0);
        if !shared && of_address >= self.max_of_address {
            let shed = open.shed(|other| *other == client);
            shed.ok_or(NoRoom::Address)?;
            self.shed.increment(1);
        } else if open.connections.len() >= self.max {
            open.shed(|_| true).ok_or(NoRoom::All)?;
            self.shed.increment(1);
        }
        let number = open.next;
        open.next += 1;
        let activity = Activity::new();
        let connection = (client.clone(), activity.clone());
        open.connections.insert(number, connection);
        *open.counts.entry(client).or_default() += 1;
        Ok(ConnectionPermit {
            connections: self.clone(),
            number,
            activity,
        })
    }

    fn open(&self) -> MutexGuard<'_, Open> {
        // Nothing panics while it is held.
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Open {
    /// Closes an idle connection of those clients, if there is one.
    fn shed(&mut self, of: impl Fn(&Client) -> bool) -> Option<()> {
        let idle = self
            .connections
            .iter()
            .filter_map(|(number, (client, activity))| {
                let since = activity.idle_since().filter(|_| of(client))?;
                Some((self.counts.get(client), Reverse((since, *number))))
            });
        let (_, Reverse((_, number))) = idle.max()?;
        self.remove(number)?.shed.notify_one();
        Some(())
    }

    fn remove(&mut self, number: u64) -> Option<Arc<Activity>> {
        let (client, activity) = self.connections.remove(&number)?;
        if let Some(count) = self.counts.get_mut(&client) {
            *count -= 1;
            if *count == 0 {
                self.counts.remove(&client);
            }
        }
        Some(activity)
    }
}

impl Drop for ConnectionPermit {
    fn drop(&mut self) {
        self.connections.open().remove(self.number);
        self.connections.ended.notify_one();
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
        // It has begun to send a body.
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
        // Its own idle ones went for them.
        assert_eq!(connections.open().counts[&Client::at(address(1))], 2);
        drop(idle);
        assert!(numbers().contains(&busy.number), "a busy one is not closed");
    }
}
