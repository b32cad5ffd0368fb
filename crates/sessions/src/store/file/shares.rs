//! The sessions that each client has in the store, as far as this process opened them.
//!
//! A session may leave memory and stay in the store, so its place there is counted apart: until it is ended, or until
//! its record has expired, which is looked up when there is no room.

use super::super::record::SessionName;
use super::super::session_store::{Counted, StoreShare};
use crate::clock::Clock;
use crate::sync::{Mutex, lock};
use std::collections::HashMap;
use std::time::Duration;

/// The record of a session that was counted less than this time ago may not be written yet.
const FRESH: Duration = Duration::from_secs(60);

/// The counted sessions of each client.
#[derive(Debug)]
pub(super) struct Shares {
    clock: Clock,
    clients: Mutex<HashMap<String, Vec<Member>>>,
}

#[derive(Debug)]
struct Member {
    session: Counted,
    /// When the session was counted, by the clock.
    since: Duration,
}

impl Shares {
    pub(super) fn new(clock: Clock) -> Self {
        Self {
            clock,
            clients: Mutex::default(),
        }
    }

    /// Counts a session, where its client has room for it.
    pub(super) fn admit(&self, share: &StoreShare, session: Counted) -> bool {
        let mut clients = lock(&self.clients);
        let members = clients.entry(share.client.clone()).or_default();
        let all = || {
            members
                .iter()
                .map(|member| &member.session)
                .chain([&session])
        };
        let places: usize = all().map(|counted| counted.places).sum();
        let bytes: usize = all().map(|counted| counted.bytes).sum();
        let fits = places <= share.max_places && bytes <= share.max_bytes;
        if fits {
            let since = self.clock.now();
            members.push(Member { session, since });
        }
        fits
    }

    /// The sessions of a client whose records may have expired.
    pub(super) fn doubtful(&self, client: &str) -> Vec<SessionName> {
        let clients = lock(&self.clients);
        let members = clients.get(client).into_iter().flatten();
        let now = self.clock.now();
        let age = |member: &Member| now.saturating_sub(member.since);
        let old = members.filter(|member| age(member) >= FRESH.min(member.session.ttl));
        old.map(|member| member.session.name).collect()
    }

    /// Gives back the places of sessions that are not in the store any more.
    pub(super) fn remove(&self, gone: &[SessionName]) {
        lock(&self.clients).retain(|_, members| {
            members.retain(|member| !gone.contains(&member.session.name));
            !members.is_empty()
        });
    }
}
