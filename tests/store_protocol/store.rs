//! The store: one record, and the scripts that replicas run on it.

use crate::State;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Version {
    pub generation: u64,
    pub frame: usize,
    pub checkpoint: usize,
}

#[derive(Clone, Debug)]
pub struct Record {
    pub version: Version,
    pub token: u64,
    pub state: State,
    /// The last state that was accepted, written or not. No script reads it.
    pub accepted: State,
}

#[derive(Clone, Debug)]
pub struct Copy {
    pub version: Version,
    pub state: State,
}

#[derive(Clone, Debug)]
pub enum Call {
    Load,
    Check(Version),
    /// A stream is opened.
    Fence(Version),
    Advance {
        before: Version,
        token: u64,
        stream: Option<u64>,
        tracked: State,
        writes: bool,
    },
}

#[derive(Clone, Debug)]
pub enum Reply {
    Done,
    Other(Copy),
}

impl Record {
    /// Runs a script. `newest_stream` is the generation that the newest open stream has begun.
    pub fn run(&mut self, call: Call, newest_stream: &mut Option<u64>) -> Reply {
        match call {
            Call::Load => Reply::Other(self.told()),
            Call::Check(version) => match self.is_at(version) {
                true => Reply::Done,
                false => self.take_over(),
            },
            Call::Fence(version) => match self.is_at(version) {
                true => {
                    self.version.generation += 1;
                    *newest_stream = Some(self.version.generation);
                    Reply::Done
                }
                false => self.take_over(),
            },
            Call::Advance {
                before,
                token,
                stream,
                tracked,
                writes,
            } => {
                if self.token == token {
                    return Reply::Done;
                }
                if !self.is_at(before) {
                    return self.take_over();
                }
                if stream.is_some() {
                    assert_eq!(stream, *newest_stream, "an old stream tracks on");
                }
                let (_, before) = tracked.split_last().expect("a frame was tracked");
                assert_eq!(
                    before, self.accepted,
                    "a frame follows another than its own"
                );
                self.accepted.clone_from(&tracked);
                self.token = token;
                self.version.frame = tracked.len() - 1;
                if writes {
                    self.version.checkpoint = tracked.len() - 1;
                    self.state = tracked;
                }
                Reply::Done
            }
        }
    }

    /// The record as the scripts tell it: at its checkpoint.
    fn told(&self) -> Copy {
        Copy {
            version: Version {
                frame: self.version.checkpoint,
                ..self.version
            },
            state: self.state.clone(),
        }
    }

    fn is_at(&self, version: Version) -> bool {
        (self.version.generation, self.version.frame) == (version.generation, version.frame)
    }

    /// The replica that asks goes on from the checkpoint.
    fn take_over(&mut self) -> Reply {
        if self.version.frame != self.version.checkpoint {
            self.version.generation += 1;
            self.version.frame = self.version.checkpoint;
            self.token = 0;
            self.accepted.clone_from(&self.state);
        }
        Reply::Other(self.told())
    }
}
