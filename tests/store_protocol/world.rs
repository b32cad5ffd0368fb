//! The replicas, the store, and the calls and replies between them.

use crate::replica::{Answer, Job, Replica, Request};
use crate::store::{Call, Copy, Record, Reply, Version};
use crate::{STREAM, State};

pub struct World {
    pub every: usize,
    pub record: Record,
    pub replicas: [Replica; 2],
    /// Calls on their way to the store: who called, the number of the job, and the call.
    pub calls: Vec<(usize, u64, Call)>,
    pub replies: Vec<(usize, u64, Reply)>,
    /// The number of the frame that the client sends next.
    pub next: [usize; 2],
    /// The longest state up to a checkpoint that an answer has told.
    pub promised: State,
    /// The generation that the newest open stream has begun.
    pub newest_stream: Option<u64>,
    pub jobs: u64,
}

impl World {
    pub fn new(every: usize) -> Self {
        let version = Version {
            generation: 1,
            frame: 0,
            checkpoint: 0,
        };
        Self {
            every,
            record: Record {
                version,
                token: 0,
                state: vec![0],
                accepted: vec![0],
            },
            replicas: Default::default(),
            calls: Vec::new(),
            replies: Vec::new(),
            next: [1, 1],
            promised: vec![0],
            newest_stream: None,
            jobs: 1,
        }
    }

    pub fn request(&self, sender: u8, number: usize) -> Request {
        Request {
            sender,
            number,
            promised: self.promised.len(),
            stream: None,
        }
    }

    /// A client opens a stream at a replica.
    pub fn open_stream(&mut self, replica: usize) {
        let call = match &self.replicas[replica].copy {
            None => Call::Load,
            Some(copy) => Call::Fence(copy.version),
        };
        self.call(replica, self.request(STREAM, 0), call, 0);
    }

    /// A replica gets a request, and calls the store.
    pub fn begin(&mut self, replica: usize, mut request: Request, attempts: usize) {
        if let (Some(own), Some(copy)) = (request.stream, &self.replicas[replica].copy) {
            if own != copy.version.generation {
                // Another stream has taken its place.
                self.replicas[replica].stream = None;
                return;
            }
            // Frames of a stream have no numbers.
            request.number = copy.state.len();
        }
        let call = match &self.replicas[replica].copy {
            None => Call::Load,
            Some(copy) if request.number == copy.state.len() => {
                let mut tracked = copy.state.clone();
                tracked.push(request.sender);
                Call::Advance {
                    before: copy.version,
                    token: self.jobs,
                    stream: request.stream,
                    writes: request.number >= copy.version.checkpoint + self.every,
                    tracked,
                }
            }
            Some(copy) => Call::Check(copy.version),
        };
        self.call(replica, request, call, attempts);
    }

    pub fn call(&mut self, replica: usize, request: Request, call: Call, attempts: usize) {
        let number = self.jobs;
        self.jobs += 1;
        self.calls.push((replica, number, call.clone()));
        self.replicas[replica].job = Some(Job {
            request,
            call,
            number,
            attempts,
        });
    }

    /// The store runs a script.
    pub fn run(&mut self, call: Call) -> Reply {
        self.record.run(call, &mut self.newest_stream)
    }

    /// A replica gets a reply. What it answers its client, if that is all.
    pub fn end(&mut self, replica: usize, number: u64, reply: Reply) -> Option<(Request, Answer)> {
        let job = self.replicas[replica]
            .job
            .take_if(|job| job.number == number)?;
        let slot = &mut self.replicas[replica].copy;
        match (reply, job.call) {
            (Reply::Other(copy), _) => {
                *slot = Some(copy);
                if job.attempts >= 4 {
                } else if job.request.sender == STREAM {
                    let version = slot.as_ref()?.version;
                    let call = Call::Fence(version);
                    self.call(replica, job.request, call, job.attempts + 1);
                } else {
                    self.begin(replica, job.request, job.attempts + 1);
                }
                None
            }
            (Reply::Done, Call::Fence(version)) => {
                let copy = slot.as_mut()?;
                copy.version.generation = version.generation + 1;
                let next = copy.state.len();
                self.replicas[replica].stream = Some(version.generation + 1);
                Some((job.request, Answer::Opened(next)))
            }
            (
                Reply::Done,
                Call::Advance {
                    before,
                    tracked,
                    writes,
                    ..
                },
            ) => {
                let frame = tracked.len() - 1;
                let checkpoint = if writes { frame } else { before.checkpoint };
                *slot = Some(Copy {
                    version: Version {
                        frame,
                        checkpoint,
                        ..before
                    },
                    state: tracked.clone(),
                });
                let state = tracked;
                Some((job.request, Answer::Tracked { state, checkpoint }))
            }
            (Reply::Done, _) => {
                let copy = slot.as_ref()?;
                let Request { sender, number, .. } = job.request;
                // The last frame, sent again with the same bytes, gets its answer again.
                let is_last = number + 1 == copy.state.len();
                let answer = match is_last && copy.state[number] == sender {
                    true => Answer::Tracked {
                        state: copy.state.clone(),
                        checkpoint: copy.version.checkpoint,
                    },
                    false => Answer::Expected(copy.state.len()),
                };
                Some((job.request, answer))
            }
        }
    }
}
