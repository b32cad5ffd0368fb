//! The store: one id, and the scripts that replicas run on it.

use crate::State;
use std::collections::BTreeSet;

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

#[derive(Debug, Default)]
pub struct Store {
    pub record: Option<Record>,
    /// The births of the sessions that were ended.
    pub ended: BTreeSet<u8>,
    /// All states that were ever accepted. No script reads it.
    pub accepted: BTreeSet<State>,
    /// The generation that the newest open stream has begun, as long as the record is not lost. No script reads it.
    pub newest_stream: Option<u64>,
}

#[derive(Clone, Debug)]
pub struct Copy {
    pub version: Version,
    pub state: State,
}

/// A call about the session that was born so.
#[derive(Clone, Debug)]
pub struct Call {
    pub birth: u8,
    pub script: Script,
}

#[derive(Clone, Debug)]
pub enum Script {
    Load,
    Check {
        version: Version,
        goes_on: bool,
    },
    /// A stream is opened.
    Fence(Version),
    /// A session is opened, or a record made from a copy.
    Create {
        generation: u64,
        token: u64,
        stream: bool,
        state: State,
    },
    Advance {
        before: Version,
        token: u64,
        stream: Option<u64>,
        tracked: State,
        writes: bool,
        goes_on: bool,
    },
    End,
}

#[derive(Clone, Debug)]
pub enum Reply {
    Missing,
    Ended,
    Done,
    Other(Copy),
}

impl Store {
    /// Runs a script.
    pub fn run(&mut self, Call { birth, script }: Call) -> Reply {
        match (script, &mut self.record) {
            (Script::End, record) => {
                let had_ended = !self.ended.insert(birth);
                match record {
                    Some(record) if record.state[0] != birth => Reply::Ended,
                    Some(_) => {
                        self.record = None;
                        Reply::Done
                    }
                    None if had_ended => Reply::Ended,
                    None => Reply::Done,
                }
            }
            (
                Script::Create {
                    generation,
                    token,
                    stream,
                    state,
                },
                None,
            ) => {
                if self.ended.contains(&birth) {
                    return Reply::Ended;
                }
                self.create(generation, token, stream, state);
                Reply::Done
            }
            (Script::Create { token, .. }, Some(record)) if record.token == token => Reply::Done,
            (Script::Create { .. } | Script::Load, Some(record)) => Reply::Other(record.told()),
            (_, None) if self.ended.contains(&birth) => Reply::Ended,
            (_, None) => Reply::Missing,
            (Script::Check { version, goes_on }, Some(record)) => match record.is_at(version) {
                true => Reply::Done,
                false => record.tell(goes_on),
            },
            (Script::Fence(version), Some(record)) => match record.is_at(version) {
                true => {
                    record.version.generation += 1;
                    self.newest_stream = Some(record.version.generation);
                    Reply::Done
                }
                false => record.tell(true),
            },
            (
                Script::Advance {
                    before,
                    token,
                    stream,
                    tracked,
                    writes,
                    goes_on,
                },
                Some(record),
            ) => {
                if record.token == token {
                    return Reply::Done;
                }
                if !record.is_at(before) {
                    return record.tell(goes_on);
                }
                if stream.is_some() && self.newest_stream.is_some() {
                    assert_eq!(stream, self.newest_stream, "an old stream tracks on");
                }
                let (_, before) = tracked.split_last().expect("a frame was tracked");
                assert_eq!(
                    before, record.accepted,
                    "a frame follows another than its own"
                );
                self.accepted.insert(tracked.clone());
                record.accepted.clone_from(&tracked);
                record.token = token;
                record.version.frame = tracked.len() - 1;
                if writes {
                    record.version.checkpoint = tracked.len() - 1;
                    record.state = tracked;
                }
                Reply::Done
            }
        }
    }

    fn create(&mut self, generation: u64, token: u64, stream: bool, state: State) {
        let (_, before) = state.split_last().expect("it has a birth");
        let is_known = |state: &[u8]| self.accepted.contains(state);
        assert!(
            state.len() == 1 || is_known(before) || is_known(&state),
            "a record is made from what was never accepted"
        );
        self.accepted.insert(state.clone());
        let frame = state.len() - 1;
        self.newest_stream = stream.then_some(generation);
        self.record = Some(Record {
            version: Version {
                generation,
                frame,
                checkpoint: frame,
            },
            token,
            accepted: state.clone(),
            state,
        });
    }
}

impl Record {
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

    /// Tells the record. `goes_on` says that the replica that asks goes on from the checkpoint.
    fn tell(&mut self, goes_on: bool) -> Reply {
        if goes_on && self.version.frame != self.version.checkpoint {
            self.version.generation += 1;
            self.version.frame = self.version.checkpoint;
            self.token = 0;
            self.accepted.clone_from(&self.state);
        }
        Reply::Other(self.told())
    }
}
