//! The records of a store in memory, with the rules of the scripts that Redis runs.

use crate::records::Backend;
use bagtrack_sessions::{Commit, Outcome, Record, SessionName, Version};
use std::collections::{BTreeSet, HashMap};
use uuid::Uuid;

/// A record, its last frame that was committed, and the token of the last write.
#[derive(Debug, Clone)]
struct Kept {
    record: Record,
    frame: u64,
    token: u64,
}

/// What the store holds. Each write has a token. A write that comes again with the same token does nothing.
#[derive(Debug, Default)]
pub struct Records {
    kept: HashMap<Uuid, Kept>,
    ended: BTreeSet<SessionName>,
    secret: Option<[u8; 32]>,
}

impl Kept {
    fn is_at(&self, version: Version) -> bool {
        (self.record.version.generation, self.frame) == (version.generation, version.frame)
    }

    /// The record at its checkpoint. Whoever goes on from there takes it over.
    fn tell(&mut self, takes_over: bool) -> Outcome {
        let version = &mut self.record.version;
        if takes_over && self.frame != version.checkpoint {
            version.generation += 1;
            (self.frame, self.token) = (version.checkpoint, 0);
        }
        version.frame = version.checkpoint;
        Outcome::Conflict(Box::new(self.record.clone()))
    }
}

impl Records {
    fn find(&mut self, name: SessionName) -> Result<&mut Kept, Outcome> {
        match self.kept.get_mut(&name.id) {
            Some(kept) => Ok(kept),
            None if self.ended.contains(&name) => Err(Outcome::Tombstoned),
            None => Err(Outcome::NotFound),
        }
    }
}

impl Backend for Records {
    fn create(&mut self, token: u64, id: Uuid, record: &Record) -> Outcome {
        let incarnation = record.opening.incarnation;
        match self.find(SessionName { id, incarnation }) {
            Ok(kept) if kept.token == token => Outcome::Committed(record.ttl),
            Ok(kept) => kept.tell(false),
            Err(Outcome::Tombstoned) => Outcome::Tombstoned,
            Err(_) => {
                let (record, frame) = (record.clone(), record.version.frame);
                let ttl = record.ttl;
                self.kept.insert(
                    id,
                    Kept {
                        record,
                        frame,
                        token,
                    },
                );
                Outcome::Committed(ttl)
            }
        }
    }

    fn load(&mut self, id: Uuid) -> Option<Record> {
        let mut kept = self.kept.get(&id)?.clone();
        match kept.tell(false) {
            Outcome::Conflict(record) => Some(*record),
            _ => None,
        }
    }

    fn commit(&mut self, token: u64, commit: Commit) -> Outcome {
        let kept = match self.find(commit.name) {
            Ok(kept) => kept,
            Err(outcome) => return outcome,
        };
        if kept.token == token {
            return Outcome::Committed(commit.ttl);
        }
        if !kept.is_at(commit.before) {
            return kept.tell(commit.takes_over);
        }
        (kept.frame, kept.token) = (commit.frame, token);
        if let Some(state) = commit.state {
            kept.record.version.checkpoint = commit.frame;
            kept.record.state = state.to_vec();
        }
        kept.record.ttl = commit.ttl;
        Outcome::Committed(commit.ttl)
    }

    fn check(&mut self, name: SessionName, version: Version, takes_over: bool) -> Outcome {
        match self.find(name) {
            Ok(kept) if kept.is_at(version) => Outcome::Committed(kept.record.ttl),
            Ok(kept) => kept.tell(takes_over),
            Err(outcome) => outcome,
        }
    }

    fn fence(&mut self, name: SessionName, version: Version) -> Outcome {
        match self.find(name) {
            Ok(kept) if kept.is_at(version) => {
                kept.record.version.generation += 1;
                Outcome::Committed(kept.record.ttl)
            }
            Ok(kept) => kept.tell(true),
            Err(outcome) => outcome,
        }
    }

    fn end(&mut self, name: SessionName) -> bool {
        let is_own = |kept: &Kept| kept.record.opening.incarnation == name.incarnation;
        let is_here = match self.kept.get(&name.id) {
            Some(kept) => is_own(kept),
            None => !self.ended.contains(&name),
        };
        self.kept.retain(|id, kept| *id != name.id || !is_own(kept));
        self.ended.insert(name);
        is_here
    }

    fn secret(&mut self, new: [u8; 32]) -> [u8; 32] {
        *self.secret.get_or_insert(new)
    }

    fn forget(&mut self) {
        self.kept.clear();
    }

    fn restart(&mut self) {
        // These records stand for a Redis, which goes on without a restart.
    }

    fn knows_repeats(&self) -> bool {
        true
    }
}
