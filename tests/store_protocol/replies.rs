//! What a replica does with the store's reply.

use crate::replica::{Answer, Job, Replica, Request};
use crate::store::{Copy, Reply, Script, Version};
use crate::world::World;
use crate::{SESSION, STREAM};

impl World {
    /// A replica gets a reply. What it answers its client, if that is all.
    pub fn end(&mut self, replica: usize, number: u64, reply: Reply) -> Option<(Request, Answer)> {
        let job = self.replicas[replica]
            .job
            .take_if(|job| job.number == number)?;
        let request = job.request;
        match reply {
            Reply::Other(copy) => return self.go_on(replica, &job, copy),
            Reply::Missing => return self.missing(replica, &job),
            Reply::Ended => {
                self.replicas[replica].copy = None;
                if matches!(job.call.script, Script::End) && job.attempts == 0 {
                    // Another session may have the id by now.
                    self.call(replica, request, Script::Load, 1);
                }
            }
            Reply::Done => return self.done(replica, job),
        }
        None
    }

    /// The record has another version.
    fn go_on(&mut self, replica: usize, job: &Job, copy: Copy) -> Option<(Request, Answer)> {
        let (request, attempts) = (job.request, job.attempts + 1);
        let slot = &mut self.replicas[replica].copy;
        let opens = request.sender == SESSION && matches!(job.call.script, Script::Create { .. });
        let is_other = |own: &Copy| own.state[0] != copy.state[0];
        if !opens && slot.as_ref().is_some_and(is_other) {
            // Another session has the id by now. The next request finds it.
            *slot = None;
            return None;
        }
        let (version, birth) = (copy.version, copy.state[0]);
        *slot = Some(copy);
        if opens {
            // The same request has opened it before.
            return Some((request, Answer::Born(birth)));
        }
        match request.sender {
            _ if attempts > 4 => {}
            SESSION => self.call(replica, request, Script::End, attempts),
            STREAM => self.call(replica, request, Script::Fence(version), attempts),
            _ => return self.begin(replica, request, attempts, true, false),
        }
        None
    }

    /// There is no record. A copy is the newest, so far as the request tells, if the request follows it or repeats it.
    fn missing(&mut self, replica: usize, job: &Job) -> Option<(Request, Answer)> {
        let (request, attempts) = (job.request, job.attempts + 1);
        let state = self.replicas[replica].copy.as_ref()?.state.clone();
        match request.sender {
            SESSION => None,
            STREAM => {
                self.create(replica, request, state, attempts);
                None
            }
            _ if request.number == state.len() => {
                self.begin(replica, request, attempts, false, true)
            }
            sender if request.number + 1 == state.len() && state[request.number] == sender => {
                self.create(replica, request, state, attempts);
                None
            }
            // Another replica may have a newer copy.
            _ if request.number > state.len() => None,
            _ => Some((request, Answer::Expected(state.len()))),
        }
    }

    /// The store has done what it was asked for.
    fn done(&mut self, replica: usize, job: Job) -> Option<(Request, Answer)> {
        let Replica { copy, stream, .. } = &mut self.replicas[replica];
        let request = job.request;
        let answer = match job.call.script {
            Script::End => {
                *copy = None;
                Answer::Ended
            }
            Script::Fence(version) => {
                let copy = copy.as_mut()?;
                copy.version.generation = version.generation + 1;
                *stream = Some(version.generation + 1);
                Answer::Opened(copy.state.len())
            }
            Script::Create {
                generation, state, ..
            } => {
                let frame = state.len() - 1;
                let version = Version {
                    generation,
                    frame,
                    checkpoint: frame,
                };
                *copy = Some(Copy {
                    version,
                    state: state.clone(),
                });
                if request.stream.is_some() {
                    *stream = Some(generation);
                }
                match request.sender {
                    SESSION => Answer::Born(state[0]),
                    STREAM => {
                        self.call(replica, request, Script::Fence(version), job.attempts);
                        return None;
                    }
                    _ => Answer::Tracked {
                        state,
                        checkpoint: frame,
                    },
                }
            }
            Script::Advance {
                before,
                tracked,
                writes,
                ..
            } => {
                let frame = tracked.len() - 1;
                let checkpoint = if writes { frame } else { before.checkpoint };
                let version = Version {
                    frame,
                    checkpoint,
                    ..before
                };
                *copy = Some(Copy {
                    version,
                    state: tracked.clone(),
                });
                let state = tracked;
                Answer::Tracked { state, checkpoint }
            }
            Script::Check { .. } | Script::Load => copy.as_ref()?.settle(request),
        };
        Some((request, answer))
    }
}
