//! Which frames the store has had and what replicas have answered, whether or not the caller got the answer; and the
//! broken promises.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The journal. Clones share its pages.
#[derive(Debug, Clone, Default)]
pub struct Journal(Arc<Mutex<Pages>>);

#[derive(Debug, Default)]
struct Pages {
    /// The last frame number of each session's record, as it was written last.
    records: BTreeMap<String, u64>,
    /// Pairs of session and frame: in `frames` those whose number the store has had, in `checkpoints` those whose state
    /// it has had.
    frames: BTreeSet<(String, u64)>,
    checkpoints: BTreeSet<(String, u64)>,
    /// By session and frame: the digest of what was sent, and the first answer.
    answers: BTreeMap<(String, u64), (u64, String)>,
    answered: u64,
    faults: Vec<String>,
}

/// An answer to a frame, as a replica gave it.
#[derive(Debug)]
pub struct Given {
    pub session: String,
    pub frame: u64,
    /// A digest of what was sent.
    pub sent: u64,
    /// The box, the score and the status.
    pub answer: String,
    /// The last frame whose state is in the store, as the answer tells it.
    pub checkpoint: Option<u64>,
}

impl Journal {
    /// Notes that the store has this frame of a session, and its state at the checkpoint.
    pub fn stored(&self, session: &str, frame: u64, checkpoint: u64) {
        let mut pages = self.lock();
        // A request with several frames writes only the last number: the store has those before it, too.
        let before = pages.records.insert(session.to_owned(), frame);
        let first = before.map_or(0, |before| before + 1).min(frame);
        let taken = (first..=frame).map(|frame| (session.to_owned(), frame));
        pages.frames.extend(taken);
        pages.checkpoints.insert((session.to_owned(), checkpoint));
    }

    /// Checks a replica's answer. With a store, the store must have the frame and the checkpoint before the answer is
    /// given. A frame number has one answer only; but where not each state is written, a frame may get lost, and
    /// another frame may then have its number and another answer.
    pub fn answered(&self, given: Given, has_store: bool, writes_each: bool) {
        let mut pages = self.lock();
        pages.answered += 1;
        let key = (given.session.clone(), given.frame);
        let lost = given
            .checkpoint
            .is_some_and(|frame| !pages.checkpoints.contains(&(given.session.clone(), frame)));
        if has_store && (!pages.frames.contains(&key) || lost) {
            let fault = format!("answered, and not in the store: {given:?}");
            pages.faults.push(fault);
        }
        let (sent, answer) = pages
            .answers
            .entry(key)
            .or_insert_with(|| (given.sent, given.answer.clone()))
            .clone();
        if answer != given.answer && (sent == given.sent || writes_each) {
            let fault = format!("answered before with {answer}: {given:?}");
            pages.faults.push(fault);
        }
    }

    /// Notes a broken promise.
    pub fn fault(&self, fault: String) {
        self.lock().faults.push(fault);
    }

    pub fn faults(&self) -> Vec<String> {
        self.lock().faults.clone()
    }

    /// How many frames replicas have answered.
    pub fn answers(&self) -> u64 {
        self.lock().answered
    }

    fn lock(&self) -> MutexGuard<'_, Pages> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
