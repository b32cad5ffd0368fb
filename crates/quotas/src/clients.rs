//! Who counts as one client for quotas and turns, and the accounts of all clients.

use super::account::{Account, Quotas};
use super::video_places::VideoPlaces;
use bagtrack_config::Config;
use bagtrack_net::{customer_address, wider_networks};
use bagtrack_sessions::{Budget, Flow, MAX_LIST_BYTES};
use ipnet::Ipv6Net;
use std::collections::HashMap;
use std::fmt;
use std::net::IpAddr;
use std::num::NonZeroU32;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use uuid::Uuid;

/// A client: all its requests share quotas and turns.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Client {
    /// The name of an API key.
    Key(Arc<str>),
    /// A page with a token of this key for this session: a part of the client with the key.
    Page(Arc<str>, Uuid),
    /// An IPv4 address, or the first address of an IPv6 network of 64 bits.
    Address(IpAddr),
}

impl Client {
    /// The client at this address.
    pub fn at(address: IpAddr) -> Self {
        Self::Address(customer_address(address))
    }

    /// The wider networks that the client's address is in: a provider may have given one of them to a single customer.
    pub fn networks(&self) -> impl Iterator<Item = Ipv6Net> {
        let address = match self {
            Self::Address(address) => Some(*address),
            Self::Key(_) | Self::Page(..) => None,
        };
        address.into_iter().flat_map(wider_networks)
    }

    /// The name of the client's API key; `None` for a client without a key.
    pub fn key(&self) -> Option<&Arc<str>> {
        match self {
            Self::Key(name) | Self::Page(name, _) => Some(name),
            Self::Address(_) => None,
        }
    }
}

impl fmt::Display for Client {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Key(name) | Self::Page(name, _) => write!(formatter, "key {name}"),
            Self::Address(address) => write!(formatter, "address {address}"),
        }
    }
}

/// The budgets of all clients together, of a network, or of one client, with what is held of each.
#[derive(Debug, Clone)]
pub struct Holdings {
    /// Places of sessions: one for each target.
    pub sessions: Budget,
    /// Bytes of the states of sessions.
    pub session_bytes: Budget,
    /// Bytes of bodies that have arrived, and of answers that clients have not received yet.
    pub upload_bytes: Budget,
    /// Streams, each of which has a connection.
    pub streams: Budget,
}

impl Holdings {
    /// The budgets of all clients together. With a store, sessions leave memory for new ones, so only each client's own
    /// quota bounds its sessions.
    pub(super) fn of_all(config: &Config, has_store: bool) -> Self {
        let of_memory = |most: usize| Budget::new(if has_store { usize::MAX } else { most });
        Self {
            sessions: of_memory(config.max_sessions),
            session_bytes: of_memory(config.session_bytes()),
            upload_bytes: Budget::new(config.max_upload_bytes),
            streams: Budget::new(config.max_connections),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        let budgets = [
            &self.sessions,
            &self.session_bytes,
            &self.upload_bytes,
            &self.streams,
        ];
        budgets.iter().all(|budget| budget.held() == 0)
    }

    /// The budgets of a network, without a maximum of their own: a [`Charge`](bagtrack_sessions::Charge) bounds them by
    /// what is free.
    pub(super) fn of_network() -> Self {
        let budget = || Budget::new(usize::MAX);
        Self {
            sessions: budget(),
            session_bytes: budget(),
            upload_bytes: budget(),
            streams: budget(),
        }
    }
}

/// What the clients of a network have together.
#[derive(Debug)]
pub(super) struct Network {
    pub(super) held: Holdings,
    pub(super) videos: VideoPlaces,
}

/// Where there are more accounts than this, those with nothing in use are forgotten.
const MAX_IDLE_ACCOUNTS: usize = 1024;

/// The accounts of all clients.
#[derive(Debug)]
pub struct Clients {
    quotas: Quotas,
    all: Holdings,
    accounts: Mutex<HashMap<Client, Arc<Account>>>,
    networks: Mutex<HashMap<Ipv6Net, Arc<Network>>>,
    /// The places for decoding videos that the clients of one network may take.
    network_videos: usize,
    next_flow: AtomicU64,
}

impl Clients {
    /// No accounts yet, with the quotas of this configuration. `has_store` says that sessions are in a store, and
    /// memory is a cache.
    pub fn new(config: &Config, has_store: bool) -> Self {
        let limits = &config.limits;
        let quarter = |share: Option<usize>, whole: usize| share.unwrap_or(whole.div_ceil(4));
        let frames = NonZeroU32::new(limits.client_frame_rate).map(|rate| {
            // The burst must fit a request with the most frames.
            let burst = u32::try_from(config.max_frames).unwrap_or(u32::MAX);
            (rate, rate.max(NonZeroU32::new(burst).unwrap_or(rate)))
        });
        let bytes = quarter(limits.client_upload_bytes, config.max_upload_bytes);
        Self {
            quotas: Quotas {
                sessions: quarter(limits.client_sessions, config.max_sessions),
                // The share must fit one session.
                session_bytes: quarter(None, config.session_bytes()).max(MAX_LIST_BYTES),
                requests: quarter(limits.client_requests, config.queue),
                streams: quarter(limits.client_connections, config.max_connections),
                upload_bytes: bytes.max(config.max_body_bytes),
                frames,
            },
            all: Holdings::of_all(config, has_store),
            accounts: Mutex::default(),
            networks: Mutex::default(),
            // One is left to others.
            network_videos: config.video_places() - 1,
            next_flow: AtomicU64::new(0),
        }
    }

    /// The account of a client.
    pub fn account(&self, client: &Client) -> Arc<Account> {
        let key = match client {
            Client::Page(name, _) => Some(self.account(&Client::Key(name.clone()))),
            _ => None,
        };
        let mut accounts = self.lock();
        if let Some(account) = accounts.get(client) {
            return account.clone();
        }
        if accounts.len() >= MAX_IDLE_ACCOUNTS {
            accounts.retain(|_, account| Arc::strong_count(account) > 1 || !account.is_idle());
        }
        if let Some(key) = key {
            let account = Arc::new(Account::of_page(client.clone(), key));
            accounts.insert(client.clone(), account.clone());
            return account;
        }
        let flow = Flow(self.next_flow.fetch_add(1, Ordering::Relaxed));
        let networks = client.networks().map(|network| self.network(network));
        let networks: Vec<Arc<Network>> = networks.collect();
        let account = Arc::new(Account::new(
            client.clone(),
            flow,
            self.quotas,
            self.all.clone(),
            networks,
        ));
        accounts.insert(client.clone(), account.clone());
        account
    }

    /// The budgets of all clients together.
    pub fn all(&self) -> &Holdings {
        &self.all
    }

    /// What the clients of a network have together.
    fn network(&self, network: Ipv6Net) -> Arc<Network> {
        // Nothing panics while the lock is held.
        let mut networks = self.networks.lock().unwrap_or_else(PoisonError::into_inner);
        if networks.len() >= MAX_IDLE_ACCOUNTS {
            networks.retain(|_, network| Arc::strong_count(network) > 1);
        }
        networks
            .entry(network)
            .or_insert_with(|| {
                Arc::new(Network {
                    held: Holdings::of_network(),
                    videos: VideoPlaces::new(self.network_videos),
                })
            })
            .clone()
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<Client, Arc<Account>>> {
        // Nothing panics while the lock is held.
        self.accounts.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
