//! Takes the next frames of a session, in their turn.
//!
//! A numbered frame that comes a little early waits for the frames before it. With a store these may come to other
//! replicas, so the store is asked for the session's last frame. Frames without numbers have no known order: a request
//! with such frames is refused if it comes while another one with frames is at the session.

use super::error::{ActError, FramesError};
use super::frames::{FrameBatch, Tracked};
use super::service::SessionService;
use crate::clock::{self, timeout};
use crate::planted::PlantedFault;
use crate::store::{Commit, Intent, Outcome, Step, StoreUnavailable, reconcile};
use crate::{
    LockedSession, QueuePermit, ReplayError, SessionBusy, SessionPermit, SessionState, Stopped,
};
use bytes::Bytes;
use std::sync::Arc;
use std::time::Duration;

/// How long an early frame waits for its turn.
const PATIENCE: Duration = Duration::from_secs(2);
/// The pause after the first question to the store. The pause doubles after each question, up to the longest.
const FIRST_PAUSE: Duration = Duration::from_millis(20);
const LONGEST_PAUSE: Duration = Duration::from_millis(320);

impl SessionService {
    /// Waits for the turn of a request whose (first) frame has this number. While it waits, its place in the queue is
    /// free for another request.
    ///
    /// # Errors
    /// The frame has no number, and another request with frames was at the session when this one came; or the frame is
    /// early, and this request took the session's last permit; or the session has ended, the store gives no answer, or
    /// the queue is full after the wait.
    pub async fn wait_for_turn(
        &self,
        permit: &SessionPermit,
        queue: QueuePermit,
        number: Option<u64>,
    ) -> Result<QueuePermit, FramesError> {
        let Some(number) = number else {
            return match permit.overlaps() {
                true => Err(FramesError::NotInOrder),
                false => Ok(queue),
            };
        };
        if !permit.is_early(number) {
            return Ok(queue);
        }
        if !permit.may_wait() {
            return Err(SessionBusy.into());
        }
        let flow = queue.flow();
        let request = queue.yield_place();
        if self.store.is_none() {
            permit.wait_for_turn(number, PATIENCE).await;
            return Ok(self.admission.rejoin(request)?);
        }
        let (deadline, mut pause) = (clock::now() + PATIENCE, FIRST_PAUSE);
        while permit.is_early(number) && clock::now() < deadline {
            self.refresh(permit.session(), Some(permit), flow).await?;
            permit.wait_for_turn(number, pause).await;
            pause = LONGEST_PAUSE.min(2 * pause);
        }
        Ok(self.admission.rejoin(request)?)
    }
}

/// How often the frames of one request are tracked at most: each time another replica may commit a frame first.
const MAX_ATTEMPTS: usize = 4;

/// The result of a request's frames, on a copy of the session's state.
enum Attempt {
    /// The frames were tracked: the state after them, the answers, and the state's bytes where it is to be stored.
    Tracked(Box<SessionState>, Tracked, Option<Bytes>),
    /// All frames were answered before; these are the stored answers.
    Replayed(Tracked),
    /// The frame number does not fit this copy, but may fit a newer state in the store.
    Misnumbered(ReplayError),
}

impl SessionService {
    /// The answers to the next frames of a session.
    ///
    /// # Errors
    /// A frame cannot be tracked, the frame number does not fit, the session has ended, the store gives no answer, or
    /// time is over. The session is unchanged.
    pub async fn advance(
        &self,
        permit: SessionPermit,
        queue: QueuePermit,
        batch: FrameBatch,
    ) -> Result<Tracked, FramesError> {
        let (session, is_posted) = (permit.session().clone(), batch.stream.is_none());
        let (width, height) = session.source_size();
        let pixels = u64::from(width) * u64::from(height);
        let queue = queue.for_size(pixels, largest(&batch.files));
        let advancing = self.advance_until_committed(permit, queue, Arc::new(batch));
        let advanced = timeout(self.settings.work_timeout, advancing).await;
        let advanced = advanced.unwrap_or_else(|_| Err(Stopped::Deadline.into()));
        if let Err(error) = &advanced
            && is_posted
            && error.is_temporary()
        {
            let is_away = matches!(error, FramesError::Act(ActError::Store(_)));
            self.renew(&session, !is_away).await;
        }
        advanced
    }

    async fn advance_until_committed(
        &self,
        permit: SessionPermit,
        queue: QueuePermit,
        batch: Arc<FrameBatch>,
    ) -> Result<Tracked, FramesError> {
        let flow = queue.flow();
        let mut locked = match batch.is_unordered() {
            true => self.lock_newest(permit, flow, true).await?,
            false => permit.lock().await?,
        };
        // Whether another replica's frame was committed before tracked ones of this request, and whether the copy was
        // loaded from the store for this request.
        let (mut was_late, mut is_told) = (false, false);
        for _ in 0..MAX_ATTEMPTS {
            let attempt;
            (locked, attempt) = self.attempt(queue.clone(), locked, batch.clone()).await?;
            let intent = attempt.intent(&batch, locked.state().latest_frame(), is_told);
            let outcome = self
                .commit(&locked, &attempt, &batch, intent, is_told)
                .await;
            let incarnation = locked.session().name().incarnation;
            match reconcile(incarnation, intent, outcome) {
                Step::Commit(_) => return attempt.accept(&mut locked, was_late),
                Step::GoOn(record) => {
                    was_late |= matches!(attempt, Attempt::Tracked(..));
                    is_told = true;
                    locked = self.take_over(locked, *record, flow).await?;
                }
                Step::Conflict(record) => {
                    self.take_over(locked, *record, flow).await?;
                    return Err(FramesError::NotInOrder);
                }
                step => {
                    attempt.keep_uncommitted(&mut locked);
                    return Err(self.refusal(locked.session(), step).into());
                }
            }
        }
        Err(SessionBusy.into())
    }

    /// Tracks the frames on a worker, on a copy of the state; or finds their stored answers.
    async fn attempt(
        &self,
        queue: QueuePermit,
        mut locked: LockedSession,
        batch: Arc<FrameBatch>,
    ) -> Result<(LockedSession, Attempt), FramesError> {
        let (limits, metrics) = (self.request_limits(), self.tracking.clone());
        // A draining process ends soon: it stores the state after every request.
        let every = if self.is_draining() {
            1
        } else {
            self.settings.store_every
        };
        self.run(queue, move |meter| {
            let session = locked.session().clone();
            if batch
                .stream
                .as_ref()
                .is_some_and(|place| place.has_ended(&session))
            {
                return Err(FramesError::StreamReplaced);
            }
            let mut copy = locked.state().clone();
            let attempt = match batch.track(&mut copy, &limits, meter, &metrics) {
                Ok(tracked) if tracked.replayed => Attempt::Replayed(tracked),
                Ok(tracked) => {
                    let is_due = |checkpoint| copy.latest_frame() >= checkpoint + every;
                    let bytes = session.checkpoint().is_some_and(is_due);
                    let bytes = bytes.then(|| copy.stored().into());
                    Attempt::Tracked(Box::new(copy), tracked, bytes)
                }
                Err(FramesError::Replay(error)) => Attempt::Misnumbered(error),
                Err(error) => return Err(error),
            };
            Ok((locked, attempt))
        })
        .await
    }

    /// Commits tracked frames to the store; for others, asks the store whether the copy is the newest. Without a store
    /// the copy always is.
    async fn commit(
        &self,
        locked: &LockedSession,
        attempt: &Attempt,
        batch: &FrameBatch,
        intent: Intent,
        is_told: bool,
    ) -> Result<Outcome, StoreUnavailable> {
        let (session, ttl) = (locked.session(), self.registry.idle_lease());
        let (Some(store), Some(before)) = (&self.store, session.version()) else {
            return Ok(Outcome::Committed(ttl));
        };
        match attempt {
            Attempt::Tracked(state, _, bytes) => {
                let commit = Commit {
                    name: session.name(),
                    before,
                    frame: state.latest_frame(),
                    state: bytes.clone(),
                    // A numbered frame may be late: another replica may have tracked frames after it. So its first
                    // attempt does not take the record back to its checkpoint.
                    takes_over: is_told || batch.number.is_none(),
                    ttl,
                };
                if PlantedFault::AnswersBeforeCommit.is_here() {
                    let store = store.clone();
                    tokio::spawn(async move { store.commit(commit).await });
                    return Ok(Outcome::Committed(ttl));
                }
                store.commit(commit).await
            }
            Attempt::Replayed(_) | Attempt::Misnumbered(_) => {
                let takes_over = !matches!(intent, Intent::Past { .. });
                let renew = matches!(attempt, Attempt::Replayed(_)).then_some(ttl);
                let checked = store.check(session.name(), before, takes_over, renew);
                checked.await
            }
        }
    }
}

pub(super) fn largest(files: &[Bytes]) -> usize {
    files.iter().map(Bytes::len).max().unwrap_or(0)
}

impl Attempt {
    /// What the request wants of the copy, whose last frame is `latest`.
    fn intent(&self, batch: &FrameBatch, latest: u64, is_told: bool) -> Intent {
        match self {
            _ if batch.is_unordered() => Intent::Unordered,
            Self::Tracked(..) => Intent::Newest,
            _ if batch.number.is_some_and(|number| number <= latest) => Intent::Past { is_told },
            _ => Intent::Newest,
        }
    }

    /// The fault [`PlantedFault::KeepsUncommitted`]: a state that the store did not take stays in memory.
    fn keep_uncommitted(self, locked: &mut LockedSession) {
        if let Self::Tracked(state, ..) = self
            && PlantedFault::KeepsUncommitted.is_here()
        {
            let version = locked.session().version();
            locked.replace(*state, version);
        }
    }

    /// Makes the copy the session's state. Returns the answers, or why the number does not fit.
    fn accept(self, locked: &mut LockedSession, was_late: bool) -> Result<Tracked, FramesError> {
        let session = locked.session().clone();
        let mut tracked = match self {
            Self::Tracked(state, tracked, bytes) => {
                let version = session.version();
                let frame = state.latest_frame();
                let after = version.map(|version| version.committed(frame, bytes.is_some()));
                locked.replace(*state, after);
                tracked
            }
            Self::Replayed(tracked) => tracked,
            // Another replica tracked another frame under this number first.
            Self::Misnumbered(ReplayError::Differs { got, expected }) if was_late => {
                return Err(ReplayError::OutOfOrder { got, expected }.into());
            }
            Self::Misnumbered(error) => return Err(error.into()),
        };
        session.renew();
        tracked.checkpoint = session.checkpoint();
        if PlantedFault::TellsEarlyCheckpoint.is_here() && tracked.checkpoint.is_some() {
            tracked.checkpoint = Some(locked.state().latest_frame());
        }
        Ok(tracked)
    }
}
