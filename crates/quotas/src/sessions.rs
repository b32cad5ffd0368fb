//! The quota of a client's sessions.

use super::account::Account;
use bagtrack_sessions::{
    BudgetFull, Charge, OpenError, QuotaExhausted, Reservation, SessionQuota, StoreShare,
    TooManySessions,
};
use std::sync::Arc;

/// The session quota of an account. A session takes a place for each of its targets.
#[derive(Debug)]
pub struct ClientSessions(pub Arc<Account>);

impl ClientSessions {
    /// Why no session can be opened: the client has its maximum, or too little is left of what all clients may have.
    fn refusal(&self, full: BudgetFull, what: &'static str, limit: usize) -> OpenError {
        match full {
            BudgetFull::Client => QuotaExhausted { what, limit }.into(),
            BudgetFull::All => TooManySessions(self.0.all.sessions.held()).into(),
        }
    }
}

impl SessionQuota for ClientSessions {
    fn check(&self) -> Result<(), OpenError> {
        match self.0.held.sessions.left() {
            0 => Err(self.refusal(BudgetFull::Client, "sessions", self.0.quotas.sessions)),
            _ => Ok(()),
        }
    }

    fn store_share(&self) -> StoreShare {
        let Account { quotas, client, .. } = &*self.0;
        StoreShare {
            client: client.to_string(),
            max_places: quotas.sessions,
            max_bytes: quotas.session_bytes,
        }
    }

    fn reserve(&self, targets: usize, bytes: usize) -> Result<Reservation, OpenError> {
        let Account {
            all, held, quotas, ..
        } = &*self.0;
        let limit = quotas.sessions;
        if targets > limit {
            return Err(OpenError::TooManyTargets {
                count: targets,
                limit,
            });
        }
        let mut places = Charge::new(&all.sessions, &held.sessions);
        let full = places.grow(targets);
        full.map_err(|full| self.refusal(full, "sessions", limit))?;
        let mut memory = Charge::new(&all.session_bytes, &held.session_bytes);
        let full = memory.grow(bytes);
        full.map_err(|full| self.refusal(full, "bytes of sessions", quotas.session_bytes))?;
        Ok(Box::new((self.0.clone(), places, memory)))
    }
}
