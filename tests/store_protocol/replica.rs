//! A replica, what it is asked, and what it answers.

use crate::State;
use crate::store::{Call, Copy};

/// A frame on its way to a replica.
#[derive(Clone, Copy, Debug)]
pub struct Request {
    pub sender: u8,
    pub number: usize,
    /// How many frames had been promised when it was sent.
    pub promised: usize,
    /// The generation that the stream began over which it comes, if one did.
    pub stream: Option<u64>,
}

/// What a replica is doing.
#[derive(Clone, Debug)]
pub struct Job {
    pub request: Request,
    pub call: Call,
    pub number: u64,
    pub attempts: usize,
}

#[derive(Clone, Debug, Default)]
pub struct Replica {
    pub copy: Option<Copy>,
    pub job: Option<Job>,
    /// The generation that the replica's stream has begun.
    pub stream: Option<u64>,
}

/// What a replica answers.
#[derive(Debug)]
pub enum Answer {
    Tracked {
        state: State,
        checkpoint: usize,
    },
    Expected(usize),
    /// The next frame of the stream that was opened.
    Opened(usize),
}
