//! A session at the service: which frames it has, and how it goes on when frames or the whole session are lost.
//! docs/PROTOCOL.md has the rules.

mod checkpoint;

use crate::backoff::RecoveryBackoff;
use crate::error::ClientError;
use crate::kept::{Kept, MOST};
use crate::transport::{Request, Standing, Transport};
use crate::upload::{Origin, Upload};
use bagtrack_api::media_types::FRAME;
use bagtrack_api::{Answer, CreatedSession, FrameAnswers, Parameters, ProblemDocument as Problem};
use bytes::Bytes;
use reqwest::Method;
use std::cmp::Ordering;
use tokio::time::Instant;
use uuid::Uuid;

/// A session at the service.
#[derive(Debug)]
pub struct Remote {
    transport: Transport,
    id: Uuid,
    /// The last frame whose answer the caller has.
    answered: u64,
    /// The last frame that the service has acknowledged.
    last_acknowledged: u64,
    /// The checkpoint and the drain notice in the last answer's headers.
    standing: Standing,
    kept: Kept,
    snapshot_every: u64,
    resent: u64,
    tried_to_move: Option<Instant>,
}

/// How to recover a session after a refusal.
enum Recovery {
    GoOnWith(u64),
    Reopen,
}

/// Opens a session; sends the request again until it is answered, or the time for retries is up.
async fn create(transport: &mut Transport, origin: &Origin) -> Result<CreatedSession, ClientError> {
    let request = origin.request(transport.carrier.new_id());
    let reply = transport.call(&request).await?;
    Ok(serde_json::from_slice(&reply.checked()?.body)?)
}

impl Remote {
    /// Opens a session from an origin, whose `frame` is ignored.
    pub async fn open(
        mut transport: Transport,
        origin: Origin,
        snapshot_every: u32,
    ) -> Result<Self, ClientError> {
        let created = create(&mut transport, &origin).await?;
        let mut query = origin.query;
        if origin.media_type == FRAME {
            // Keeps the seed that the service has drawn: only with that, a session opened again gives the same boxes.
            query.retain(|(name, _)| *name != "seed");
            let seed = created.parameters.as_ref().and_then(Parameters::seed);
            query.extend(seed.map(|seed| ("seed", seed.to_string())));
        }
        let mut kept = Kept::default();
        if snapshot_every > 0 {
            kept.renew(Origin {
                frame: created.frame,
                query,
                ..origin
            });
        }
        Ok(Self {
            transport,
            id: created.id,
            answered: created.frame,
            last_acknowledged: created.frame,
            standing: Standing::default(),
            kept,
            snapshot_every: u64::from(snapshot_every).min(MOST as u64 / 2),
            resent: 0,
            tried_to_move: None,
        })
    }

    pub fn id(&self) -> Uuid {
        self.id
    }

    pub fn answered(&self) -> u64 {
        self.answered
    }

    pub fn standing(&self) -> Standing {
        self.standing
    }

    pub fn resent(&self) -> u64 {
        self.resent
    }

    /// Sends the next frames, after those that got no answer. Returns at least one answer.
    pub async fn advance(&mut self, upload: Upload) -> Result<Vec<Answer>, ClientError> {
        let before = self.kept.last().unwrap_or(0).max(self.answered);
        // Kept before it is sent, so that a dropped call counts as one without an answer.
        self.kept.put(before + 1, upload);
        let delivered = self.deliver(before + 1).await;
        if let Err(ClientError::Refused(_)) = delivered {
            self.kept
                .forget_after(self.last_acknowledged.max(self.answered));
        }
        let answers = delivered?;
        if let Some(last) = answers.last() {
            self.answered = last.frame;
            self.checkpoint().await;
        }
        Ok(answers)
    }

    /// Brings the service up to this frame. Returns the answers to the request that has the frame.
    async fn deliver(&mut self, number: u64) -> Result<Vec<Answer>, ClientError> {
        let mut backoff = RecoveryBackoff::new(self.transport.backoff());
        loop {
            let next = (self.last_acknowledged + 1).min(number);
            let upload = self.kept.from(next);
            let upload = upload.ok_or(ClientError::NotKept { frame: next })?;
            let reply = self.transport.call(&upload.request(self.id, next)).await?;
            let problem = match reply.checked() {
                Ok(reply) => {
                    // Parsed first: a page of a proxy, which is no answer, must not acknowledge a frame.
                    let answers: FrameAnswers = serde_json::from_slice(&reply.body)?;
                    let last = upload.last(next);
                    self.last_acknowledged = self.last_acknowledged.max(last);
                    self.resent += (next..=last.min(self.answered)).count() as u64;
                    if last < number {
                        continue;
                    }
                    self.standing = reply.standing();
                    return Ok(answers.into_all());
                }
                Err(problem) => problem,
            };
            let Some(recovery) = self.recovery(&problem, next, number) else {
                return Err(problem.into());
            };
            if !backoff.wait().await {
                return Err(problem.into());
            }
            match recovery {
                Recovery::GoOnWith(frame) => self.last_acknowledged = frame.saturating_sub(1),
                Recovery::Reopen => self.reopen(problem).await?,
            }
        }
    }

    /// How to recover from this problem with frame `next`, which was sent on the way to the caller's frame `number`.
    fn recovery(&self, problem: &Problem, next: u64, number: u64) -> Option<Recovery> {
        if is_gone(problem) {
            return Some(Recovery::Reopen);
        }
        let expected = problem.expected_frame?;
        match expected.cmp(&next) {
            Ordering::Less if self.kept.from(expected).is_some() => {
                Some(Recovery::GoOnWith(expected))
            }
            // The service has a copy of the session from before the origin, as another replica may.
            Ordering::Less => Some(Recovery::Reopen),
            // The service already has frames that were sent again, perhaps with the caller's.
            Ordering::Greater if next < number => Some(Recovery::GoOnWith(expected.min(number))),
            Ordering::Equal | Ordering::Greater => None,
        }
    }

    /// Opens the session again after the service has lost it.
    async fn reopen(&mut self, mut lost: Box<Problem>) -> Result<(), ClientError> {
        let Some(origin) = self.kept.origin() else {
            return Err(lost.into());
        };
        let created = match create(&mut self.transport, origin).await {
            // For example a service with other keys, which refuses the snapshot.
            Err(ClientError::Refused(problem)) => {
                lost.detail += &format!(" It could not be opened again: {problem}");
                return Err(lost.into());
            }
            created => created?,
        };
        (self.id, self.last_acknowledged) = (created.id, created.frame);
        Ok(())
    }

    fn request_snapshot(&self) -> Request {
        Request::bare(Method::GET, format!("/sessions/{}/snapshot", self.id))
    }

    pub async fn snapshot(&mut self) -> Result<Bytes, ClientError> {
        let mut backoff = RecoveryBackoff::new(self.transport.backoff());
        loop {
            if self.last_acknowledged < self.answered {
                self.deliver(self.answered).await?;
            }
            let reply = self.transport.call(&self.request_snapshot()).await?;
            let problem = match reply.checked() {
                Ok(reply) => return reply.snapshot(),
                Err(problem) if is_gone(&problem) => problem,
                Err(problem) => return Err(problem.into()),
            };
            // After a lost answer, the next replica is asked, which may not have the session: hence the pause.
            if !backoff.wait().await {
                return Err(problem.into());
            }
            self.reopen(problem).await?;
        }
    }

    pub async fn end(mut self) -> Result<(), ClientError> {
        let request = Request::bare(Method::DELETE, format!("/sessions/{}", self.id));
        match self.transport.call(&request).await?.checked() {
            Ok(_) => Ok(()),
            // The session has ended: it expired, or the answer to an earlier try got lost.
            Err(problem) if is_gone(&problem) => Ok(()),
            Err(problem) => Err(problem.into()),
        }
    }
}

/// Whether the problem says that the service does not have the session any more.
fn is_gone(problem: &Problem) -> bool {
    matches!(problem.status, 404 | 410)
}
