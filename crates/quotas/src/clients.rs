//! The accounts of all clients.

use super::account::{Account, Quotas};
use super::client::Client;
use super::holdings::Holdings;
use bagtrack_config::Config;
use bagtrack_sessions::{Flow, MAX_LIST_BYTES};
use ipnet::Ipv6Net;
use std::collections::HashMap;
use std::num::NonZeroU32;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Accounts above which those with nothing in use are forgotten.
const MAX_IDLE_ACCOUNTS: usize = 1024;

/// The accounts of all clients.
#[derive(Debug)]
pub struct Clients {
    quotas: Quotas,
    all: Holdings,
    accounts: Mutex<HashMap<Client, Arc<Account>>>,
    networks: Mutex<HashMap<Ipv6Net, Arc<Holdings>>>,
    next_flow: AtomicU64,
}

impl Clients {
    /// No client yet, with the quotas of this configuration. Where there is a store, memory is only a cache of
    /// sessions.
    pub fn new(config: &Config, has_store: bool) -> Self {
        let limits = &config.limits;
        let quarter = |share: Option<usize>, whole: usize| share.unwrap_or(whole.div_ceil(4));
        let frames = NonZeroU32::new(limits.client_frame_rate).map(|rate| {
            // A request with as many frames as a request may have must fit.
            let burst = u32::try_from(config.max_frames).unwrap_or(u32::MAX);
            (rate, rate.max(NonZeroU32::new(burst).unwrap_or(rate)))
        });
        let bytes = quarter(limits.client_upload_bytes, config.max_upload_bytes);
        Self {
            quotas: Quotas {
                sessions: quarter(limits.client_sessions, config.max_sessions),
                // One session must fit.
                session_bytes: quarter(None, config.session_bytes()).max(MAX_LIST_BYTES),
                requests: quarter(limits.client_requests, config.queue),
                streams: quarter(limits.client_connections, config.max_connections),
                upload_bytes: bytes.max(config.max_body_bytes),
                frames,
            },
            all: Holdings::of_all(config, has_store),
            accounts: Mutex::default(),
            networks: Mutex::default(),
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
        let networks: Vec<Arc<Holdings>> = networks.collect();
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

    /// What all clients hold together.
    pub fn all(&self) -> &Holdings {
        &self.all
    }

    /// What the clients of a network hold.
    fn network(&self, network: Ipv6Net) -> Arc<Holdings> {
        // Nothing panics while it is held.
        let mut networks = self.networks.lock().unwrap_or_else(PoisonError::into_inner);
        if networks.len() >= MAX_IDLE_ACCOUNTS {
            networks.retain(|_, held| Arc::strong_count(held) > 1);
        }
        networks
            .entry(network)
            .or_insert_with(|| Arc::new(Holdings::of_network()))
            .clone()
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<Client, Arc<Account>>> {
        // Nothing panics while it is held.
        self.accounts.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
