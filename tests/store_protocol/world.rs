//! The replicas, the store, and the calls and replies between them.

use crate::replica::{Answer, Job, Replica, Request};
use crate::store::{Call, Reply, Script, Store};
use crate::{FIRST_BIRTH, SESSION, STREAM, State};
use std::collections::BTreeSet;

pub struct World {
    pub every: usize,
    pub has_rival: bool,
    pub store: Store,
    pub replicas: [Replica; 2],
    /// Calls on their way to the store: who called, the number of the job, and the call.
    pub calls: Vec<(usize, u64, Call)>,
    pub replies: Vec<(usize, u64, Reply)>,
    /// The number of the frame that the client sends next.
    pub next: [usize; 2],
    /// The client's session; none after it has ended one.
    pub birth: Option<u8>,
    /// The births of the sessions that the client has ended.
    pub ended: BTreeSet<u8>,
    /// The longest state up to a checkpoint that an answer has told.
    pub promised: State,
    /// Whether the record was lost since the session was opened.
    pub was_lost: bool,
    pub jobs: u64,
}

impl World {
    pub fn new(every: usize, has_rival: bool) -> Self {
        let mut world = Self {
            every,
            has_rival,
            store: Store::default(),
            replicas: Default::default(),
            calls: Vec::new(),
            replies: Vec::new(),
            next: [1, 1],
            birth: None,
            ended: BTreeSet::new(),
            promised: Vec::new(),
            was_lost: false,
            jobs: 1,
        };
        world.open_session(0);
        world.settle();
        world
    }

    pub fn request(&self, sender: u8, number: usize) -> Request {
        Request {
            sender,
            number,
            promised: self.promised.len(),
            birth: self.birth.unwrap_or(0),
            ended: self.ended.len(),
            stream: None,
        }
    }

    /// The client opens a session, by the same request until it has ended that one.
    pub fn open_session(&mut self, replica: usize) {
        let request = self.request(SESSION, 0);
        let birth = FIRST_BIRTH + u8::try_from(self.ended.len()).unwrap_or(u8::MAX);
        self.create(replica, request, vec![birth], 0);
    }

    /// The client ends its session.
    pub fn end_session(&mut self, replica: usize) {
        let request = self.request(SESSION, 0);
        let script = match self.replicas[replica].copy {
            None => Script::Load,
            Some(_) => Script::End,
        };
        self.call(replica, request, script, 0);
    }

    /// A client opens a stream at a replica.
    pub fn open_stream(&mut self, replica: usize) {
        let script = match &self.replicas[replica].copy {
            None => Script::Load,
            Some(copy) => Script::Fence(copy.version),
        };
        self.call(replica, self.request(STREAM, 0), script, 0);
    }

    /// A replica gets a request with a frame, and calls the store, if it cannot answer. `is_told` says that the store has
    /// told its copy, `is_lost` that the store has no record.
    pub fn begin(
        &mut self,
        replica: usize,
        mut request: Request,
        attempts: usize,
        is_told: bool,
        is_lost: bool,
    ) -> Option<(Request, Answer)> {
        if let (Some(own), Some(copy)) = (request.stream, &self.replicas[replica].copy) {
            if own != copy.version.generation {
                // Another stream has taken its place.
                self.replicas[replica].stream = None;
                return None;
            }
            // Frames of a stream have no numbers.
            request.number = copy.state.len();
        }
        let script = match &self.replicas[replica].copy {
            None => Script::Load,
            Some(copy) if request.number == copy.state.len() => {
                let mut tracked = copy.state.clone();
                tracked.push(request.sender);
                if is_lost {
                    self.create(replica, request, tracked, attempts);
                    return None;
                }
                Script::Advance {
                    before: copy.version,
                    token: self.jobs,
                    stream: request.stream,
                    writes: request.number >= copy.version.checkpoint + self.every,
                    goes_on: is_told || request.stream.is_some(),
                    tracked,
                }
            }
            Some(copy) if is_told && request.number < copy.state.len() => {
                return Some((request, copy.settle(request)));
            }
            Some(copy) => Script::Check {
                version: copy.version,
                goes_on: request.number > copy.state.len(),
            },
        };
        self.call(replica, request, script, attempts);
        None
    }

    /// Makes a record, whose generation no other has had.
    pub fn create(&mut self, replica: usize, request: Request, state: State, attempts: usize) {
        let script = Script::Create {
            generation: 1000 * self.jobs,
            token: self.jobs,
            stream: request.stream.is_some(),
            state,
        };
        self.call(replica, request, script, attempts);
    }

    pub fn call(&mut self, replica: usize, request: Request, script: Script, attempts: usize) {
        let number = self.jobs;
        self.jobs += 1;
        let birth = match (&script, &self.replicas[replica].copy) {
            (Script::Create { state, .. }, _) => state[0],
            (_, Some(copy)) => copy.state[0],
            (_, None) => 0,
        };
        let call = Call { birth, script };
        self.calls.push((replica, number, call.clone()));
        self.replicas[replica].job = Some(Job {
            request,
            call,
            number,
            attempts,
        });
    }

    /// Runs all calls, and gives all answers.
    pub fn settle(&mut self) {
        while let Some((replica, number, call)) = self.calls.pop() {
            let reply = self.run(call);
            if let Some((request, answer)) = self.end(replica, number, reply) {
                self.answer(request, answer, true);
            }
        }
    }

    /// The store runs a script.
    pub fn run(&mut self, call: Call) -> Reply {
        let had_record = self.store.record.is_some();
        let reply = self.store.run(call);
        if had_record && self.store.record.is_none() {
            self.drop_creates();
        }
        reply
    }

    /// What was sent while there was a record is not on its way for so long that there is none.
    pub fn drop_creates(&mut self) {
        let creates = |script: &Script| matches!(script, Script::Create { .. });
        self.calls.retain(|(_, _, call)| !creates(&call.script));
    }
}
