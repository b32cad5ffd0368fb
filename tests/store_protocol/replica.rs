//! A replica, what it is asked, and what it answers.

use crate::State;
use crate::store::{Call, Copy};

/// A request on its way to a replica.
#[derive(Clone, Copy, Debug)]
pub struct Request {
    pub sender: u8,
    pub number: usize,
    /// How many frames had been promised when it was sent.
    pub promised: usize,
    /// The birth of the session that it was sent to, as the client knows.
    pub birth: u8,
    /// How many sessions the client had ended.
    pub ended: usize,
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
    /// A session was opened, which was born so.
    Born(u8),
    /// The session was ended.
    Ended,
}

impl Copy {
    /// The answer to a frame that this copy is not tracked through.
    pub fn settle(&self, Request { sender, number, .. }: Request) -> Answer {
        // The last frame, sent again with the same bytes, gets its answer again.
        let is_last = number + 1 == self.state.len();
        match is_last && self.state[number] == sender {
            true => Answer::Tracked {
                state: self.state.clone(),
                checkpoint: self.version.checkpoint,
            },
            false => Answer::Expected(self.state.len()),
        }
    }
}
