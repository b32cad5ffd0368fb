//! What is held for clients until it is really given back.

use bagtrack_config::Config;
use bagtrack_sessions::Budget;

/// What is held: for all clients, for a network, or for one client.
#[derive(Debug, Clone)]
pub struct Holdings {
    /// Places of sessions: one for each target.
    pub sessions: Budget,
    /// Bytes of the states of sessions.
    pub session_bytes: Budget,
    /// Bytes of bodies that have come, and of answers that are not taken.
    pub upload_bytes: Budget,
    /// Streams, each of which has a connection.
    pub streams: Budget,
}

impl Holdings {
    /// What all clients may hold together. With a store other sessions leave memory for new ones, so each client's own
    /// quota is the only bound.
    pub(super) fn of_all(config: &Config, has_store: bool) -> Self {
        let of_memory = |most: usize| Budget::new(if has_store { usize::MAX } else { most });
        Self {
            sessions: of_memory(config.max_sessions),
            session_bytes: of_memory(config.session_bytes()),
            upload_bytes: Budget::new(config.max_upload_bytes),
            streams: Budget::new(config.max_connections),
        }
    }

    /// Whether nothing is held.
    pub(super) fn is_empty(&self) -> bool {
        let budgets = [
            &self.sessions,
            &self.session_bytes,
            &self.upload_bytes,
            &self.streams,
        ];
        budgets.iter().all(|budget| budget.held() == 0)
    }

    /// Those of a network, which has no maximum but what is free.
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
