//! The one reading of what the store says: what a replica does next with its copy of a session.

use super::record::Record;
use super::session_store::{Outcome, StoreUnavailable};
use crate::planted::PlantedFault;
use std::time::Duration;

/// What the request that called the store wants of the session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Intent {
    /// To have the newest state: for a reader, a new stream, or frames whose order is known.
    Newest,
    /// To track frames without numbers, whose order nothing tells.
    Unordered,
    /// To answer a frame that lies before the copy. `is_told` says that the store has told this copy.
    Past {
        /// Whether the copy is what the store told for this request.
        is_told: bool,
    },
}

/// Why a session is gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gone {
    /// The session was ended.
    Ended,
    /// The store has no record of it: its time is over, or the store has lost it.
    NoRecord,
}

/// What a replica does next.
#[derive(Debug)]
pub enum Step {
    /// The result that was computed from the copy stands. The record lives for this time without a further frame.
    Commit(Duration),
    /// The copy becomes this record's state, and the request is looked at again.
    GoOn(Box<Record>),
    /// The copy becomes this record's state, and the request is refused: another replica's frame came first.
    Conflict(Box<Record>),
    /// Another session has the id now.
    Replaced(Box<Record>),
    /// The session is gone.
    Gone(Gone),
    /// The store gave no answer or refused the call; nothing is known of the session.
    Unavailable(StoreUnavailable),
}

/// Reads the outcome of a call to the store. `incarnation` is that of the copy's session, `intent` what the request
/// wants of the copy.
pub fn reconcile(
    incarnation: u64,
    intent: Intent,
    outcome: Result<Outcome, StoreUnavailable>,
) -> Step {
    let record = match outcome {
        Err(_) if PlantedFault::TakesSilenceForConsent.is_here() => {
            return Step::Commit(Duration::from_secs(60));
        }
        Err(unavailable) => return Step::Unavailable(unavailable),
        Ok(Outcome::Committed(ttl)) => return Step::Commit(ttl),
        Ok(Outcome::NotFound) => return Step::Gone(Gone::NoRecord),
        Ok(Outcome::Tombstoned) => return Step::Gone(Gone::Ended),
        // Stores answer this only where a session is created.
        Ok(Outcome::Full) => return Step::Unavailable(StoreUnavailable("it is full".to_owned())),
        Ok(Outcome::Conflict(record)) => record,
    };
    if record.opening.incarnation != incarnation {
        return Step::Replaced(record);
    }
    match intent {
        // Another replica may have later frames by now; the frame lies before them.
        Intent::Past { is_told: true } => Step::Commit(record.ttl),
        Intent::Unordered => Step::Conflict(record),
        Intent::Newest | Intent::Past { is_told: false } => Step::GoOn(record),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::record::tests::record;

    fn named(step: &Step) -> &'static str {
        match step {
            Step::Commit(_) => "commit",
            Step::GoOn(_) => "go on",
            Step::Conflict(_) => "conflict",
            Step::Replaced(_) => "replaced",
            Step::Gone(Gone::Ended) => "ended",
            Step::Gone(Gone::NoRecord) => "no record",
            Step::Unavailable(_) => "unavailable",
        }
    }

    #[test]
    fn each_outcome_leads_to_one_step() {
        let ttl = Duration::from_secs(9);
        let conflict = |incarnation| Ok(Outcome::Conflict(Box::new(record(incarnation, 3))));
        let past = |is_told| Intent::Past { is_told };
        let intents = [Intent::Newest, Intent::Unordered, past(false), past(true)];
        for (outcome, expected) in [
            (Ok(Outcome::Committed(ttl)), ["commit"; 4]),
            (Ok(Outcome::NotFound), ["no record"; 4]),
            (Ok(Outcome::Tombstoned), ["ended"; 4]),
            (Err(StoreUnavailable::default()), ["unavailable"; 4]),
            (conflict(7), ["go on", "conflict", "go on", "commit"]),
            (conflict(8), ["replaced"; 4]),
        ] {
            for (intent, expected) in intents.into_iter().zip(expected) {
                let step = reconcile(7, intent, outcome.clone());
                assert_eq!(named(&step), expected, "{outcome:?} for {intent:?}");
            }
        }
    }
}
