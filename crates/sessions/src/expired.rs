//! The ids of sessions that have expired, for a while: a client whose session has expired is told so.

use super::session::Owner;
use std::collections::{HashMap, VecDeque};
use std::time::Duration;
use uuid::Uuid;

/// How long an id is kept.
const KEPT: Duration = Duration::from_secs(3600);
/// Most ids kept; the oldest go first.
const MAX_IDS: usize = 4096;

/// Ids of expired sessions.
#[derive(Debug, Default)]
pub(super) struct ExpiredIds {
    owners: HashMap<Uuid, Owner>,
    /// The same ids with the moments at which they came, oldest first.
    order: VecDeque<(Duration, Uuid)>,
}

impl ExpiredIds {
    /// Notes that the session `id` has expired by `now`.
    pub(super) fn note(&mut self, id: Uuid, owner: Owner, now: Duration) {
        self.forget(now);
        if self.owners.insert(id, owner).is_none() {
            self.order.push_back((now, id));
        }
    }

    /// Whether a session `id` of this owner has expired less than [`KEPT`] ago, as far as it is remembered.
    pub(super) fn contains(&mut self, id: Uuid, owner: &Owner, now: Duration) -> bool {
        self.forget(now);
        self.owners.get(&id) == Some(owner)
    }

    /// Makes room for one more, and drops the ids that are too old.
    fn forget(&mut self, now: Duration) {
        while let Some(&(since, id)) = self.order.front()
            && (now >= since + KEPT || self.order.len() >= MAX_IDS)
        {
            self.order.pop_front();
            self.owners.remove(&id);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_kept_for_a_while_and_not_more_than_some() {
        let (mut expired, owner) = (ExpiredIds::default(), Owner::named("a"));
        let ids: Vec<Uuid> = (0..MAX_IDS as u128 + 5).map(Uuid::from_u128).collect();
        for id in &ids {
            expired.note(*id, owner.clone(), Duration::ZERO);
        }
        assert!(expired.order.len() <= MAX_IDS && expired.owners.len() == expired.order.len());
        assert!(
            !expired.contains(ids[0], &owner, Duration::ZERO),
            "the oldest"
        );
        let last = *ids.last().unwrap();
        assert!(expired.contains(last, &owner, KEPT - Duration::from_secs(1)));
        assert!(!expired.contains(last, &Owner::default(), Duration::ZERO));
        assert!(!expired.contains(last, &owner, KEPT));
    }
}
