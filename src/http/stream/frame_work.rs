//! One frame of a stream: it gets its permits, then its answer.

use super::message;
use super::waiting::{Arrived, ArrivedFrame, Waiting};
use crate::http::extract::caller::Caller;
use crate::http::extract::overrides::rect;
use crate::http::problems::problem::Problem;
use crate::http::respond::answer::{particles, stream_answer};
use crate::http::state::AppState;
use bagtrack_api::{ProblemKind as Kind, StreamAnswer};
use bagtrack_quotas::Account;
use bagtrack_sessions::clock::{self, Instant, sleep, timeout_at};
use bagtrack_sessions::{
    ActError, FrameBatch, FramesError, KEPT_ANSWERS, QueueFull, QueuePermit, Session, SessionBusy,
    SessionPermit, StreamPlace,
};
use bagtrack_tracker::box_warnings;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use uuid::Uuid;

/// How long to wait before the store is tried again.
const STORE_RETRY: Duration = Duration::from_millis(250);

/// What the frames of one stream have in common.
#[derive(Debug)]
pub struct FrameWork {
    pub state: AppState,
    pub caller: Caller,
    /// The quotas against which the frames count.
    pub account: Arc<Account>,
    pub session: Uuid,
    pub place: Arc<StreamPlace>,
    pub waiting: Mutex<Waiting>,
}

/// What became of a frame.
#[derive(Debug)]
pub struct Done {
    /// The frame's answer, without the fields that are set when it is sent.
    pub answer: Result<StreamAnswer, Problem>,
    /// Frames before it that were skipped.
    pub skipped: u64,
}

impl FrameWork {
    pub fn waiting(&self) -> MutexGuard<'_, Waiting> {
        // Nothing panics while the lock is held.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Answers the next frame that waits. The frame is chosen only when it has its permits, so that until then a newer
    /// one can take its place. `None` if none waits.
    pub async fn answer_next(self: Arc<Self>) -> Option<Done> {
        if !self.waiting().next_is_refused() {
            let permits = self.permits().await;
            let Arrived { frame, skipped } = self.waiting().take()?;
            let answer = match (frame, permits) {
                (Ok(frame), Ok(permits)) => self.answer(frame, permits).await,
                (Err(problem), _) | (_, Err(problem)) => Err(problem),
            };
            return Some(Done { answer, skipped });
        }
        let Arrived { frame, skipped } = self.waiting().take()?;
        let answer = Err(frame.err()?);
        Some(Done { answer, skipped })
    }

    /// The permits of a frame. Where there is no place, the frame waits for one in order of arrival, as long as a plain
    /// request may.
    async fn permits(&self) -> Result<(SessionPermit, QueuePermit), Problem> {
        let deadline = clock::now() + self.state.config.work_timeout;
        let session = self.find_until(deadline).await?;
        let permit = timeout_at(deadline, session.enter_in_order()).await;
        let permit = permit.map_err(|_| SessionBusy)?;
        self.account.count_frame_in_order(deadline).await?;
        let request = timeout_at(deadline, self.account.request_in_order()).await;
        let request = match request {
            Ok(request) => request,
            Err(_) => self.account.request()?,
        };
        let queue = &self.state.service.admission;
        let queue = queue.enter_in_order(request.flow(), Box::new(request));
        let queue = timeout_at(deadline, queue).await.map_err(|_| QueueFull)?;
        Ok((permit, queue.for_frames(session.target_count())))
    }

    /// The session. While the store gives no answer, asks again until `deadline`.
    async fn find_until(&self, deadline: Instant) -> Result<Arc<Session>, Problem> {
        loop {
            match self.find().await {
                Err(problem)
                    if problem.kind() == Kind::StoreUnavailable && clock::now() < deadline =>
                {
                    sleep(STORE_RETRY).await;
                }
                found => return found,
            }
        }
    }

    /// The session, if the caller may still use it.
    async fn find(&self) -> Result<Arc<Session>, Problem> {
        let (state, caller) = (&self.state, &self.caller);
        if !state.access.holds(caller.credential(), state.now()) {
            return Err(Problem::unauthorized());
        }
        let flow = self.account.flow();
        caller.find(state, self.session, flow).await
    }

    /// Checks, while no frame comes, that the session lives, that the caller may still use it, and that no other stream
    /// has its place. Asks the store, too.
    ///
    /// # Errors
    /// The key, the token or the session has ended, or the store gives no answer.
    pub async fn check_newest(&self) -> Result<(), Problem> {
        let session = self.find().await?;
        let flow = self.account.flow();
        self.state.service.refresh(&session, None, flow).await?;
        self.place.has_ended(&session);
        Ok(())
    }

    async fn answer(
        self: &Arc<Self>,
        frame: ArrivedFrame,
        (mut session, mut queue): (SessionPermit, QueuePermit),
    ) -> Result<StreamAnswer, Problem> {
        let ArrivedFrame { header, file } = frame;
        if self.waiting().newest_wins() && header.frame.is_some() {
            let detail = "With drop=true frames are skipped, so they have no numbers.";
            return Err(Problem::malformed(detail));
        }
        if file.is_empty() {
            return Err(Problem::missing_frame());
        }
        let config = &self.state.config;
        let deadline = clock::now() + config.work_timeout;
        let mut number = header.frame;
        let shown = header.target.unwrap_or(0);
        if header.see && shown >= session.session().target_count() {
            return Err(Problem::which_target(session.session().target_count()));
        }
        loop {
            let next = FrameBatch {
                number,
                files: vec![file.clone()],
                correction: message::correction(&header),
                min_answers: KEPT_ANSWERS,
                with_diagnostics: header.see,
                stream: Some(self.place.clone()),
            };
            let at = session.session().clone();
            match self.state.service.advance(session, queue, next).await {
                Ok(answered) => {
                    let given = header.rect.map(rect);
                    let warnings = box_warnings(given.as_slice(), at.source_size());
                    return Ok(StreamAnswer {
                        replayed: answered.replayed,
                        checkpoint: answered.checkpoint,
                        seen: answered.diagnostics.into_iter().nth(shown).map(particles),
                        ..stream_answer(&answered.estimates[0], warnings)
                    });
                }
                Err(FramesError::Act(ActError::Store(_))) if clock::now() < deadline => {
                    // Perhaps the store took the frame: with its number it is not tracked twice.
                    number = number.or(Some(at.latest_frame() + 1));
                    sleep(STORE_RETRY).await;
                    (session, queue) = self.permits().await?;
                }
                Err(error) => return Err(error.into()),
            }
        }
    }
}
