//! One frame of a stream: it gets its permits, then its answer.

use super::open_streams::StreamPlace;
use super::waiting::{Arrived, ArrivedFrame, Waiting};
use crate::http::advance::{Answered, NextFrames};
use crate::http::auth::caller::Caller;
use crate::http::clients::Account;
use crate::http::problems::kind::Kind;
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use crate::http::work;
use crate::sessions::{LockedSession, QueuePermit, SessionPermit, WorkMeter};
use crate::tracker::{Estimate, Seen};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::time::{Instant, sleep};
use uuid::Uuid;

/// How long to wait before asking for a place again.
const RETRY: Duration = Duration::from_millis(20);
/// The last answers that are kept for a client that takes up after a broken line.
pub const MAX_KEPT: usize = 32;

/// What the frames of one stream have in common.
#[derive(Debug)]
pub struct FrameWork {
    /// The service.
    pub state: AppState,
    /// Who sends them.
    pub caller: Caller,
    /// The quotas that they are counted by.
    pub account: Arc<Account>,
    /// The session.
    pub session: Uuid,
    /// The stream's place.
    pub place: StreamPlace,
    /// The frames that wait.
    pub waiting: Mutex<Waiting>,
    /// Whether frames may be skipped.
    pub newest_wins: bool,
}

/// The answer to a frame.
#[derive(Debug)]
pub struct Given {
    /// Where the target is.
    pub estimate: Estimate,
    /// Whether it was given before.
    pub replayed: bool,
    /// What the tracker saw, where that was asked for.
    pub seen: Option<Seen>,
}

/// What became of a frame.
#[derive(Debug)]
pub struct Done {
    /// The answer, or the problem.
    pub answer: Result<Given, Problem>,
    /// Frames before it that were skipped.
    pub skipped: u64,
}

impl FrameWork {
    /// The frames that wait.
    pub fn waiting(&self) -> MutexGuard<'_, Waiting> {
        // Nothing panics while it is held.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Answers the next frame that waits. It is chosen when there is a place for it, so that the newest can win until
    /// then. None if none waits.
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

    /// The permits of a frame. Where there is no place it waits, as long as a plain request may.
    async fn permits(&self) -> Result<(SessionPermit, QueuePermit), Problem> {
        let deadline = Instant::now() + self.state.config.work_timeout;
        loop {
            let problem = match self.try_permits() {
                Ok(permits) => return Ok(permits),
                Err(problem) => problem,
            };
            let kind = problem.kind();
            let may_wait = matches!(
                kind,
                Kind::QueueFull | Kind::QuotaExceeded | Kind::SessionBusy
            );
            if !may_wait || Instant::now() >= deadline {
                return Err(problem);
            }
            sleep(RETRY).await;
        }
    }

    fn try_permits(&self) -> Result<(SessionPermit, QueuePermit), Problem> {
        self.check_access()?;
        let state = &self.state;
        let session = state.registry.find(self.session, self.caller.owner())?;
        let session = session.enter()?;
        let request = Arc::new(self.account.request()?);
        let queue = state
            .admission
            .enter(request.lane(), Box::new(request.clone()))?;
        request.count_frames(1)?;
        Ok((session, queue))
    }

    /// Whether the caller may still use the session, which is there.
    ///
    /// # Errors
    /// The token has ended, or the key; or the session.
    pub fn check_access(&self) -> Result<(), Problem> {
        let (state, caller) = (&self.state, &self.caller);
        let keys = &state.access.keys;
        let has_key = !keys.are_needed() || keys.has_owner(caller.owner());
        if caller.has_ended(state.now()) || !has_key {
            return Err(Problem::unauthorized());
        }
        state.registry.find(self.session, caller.owner())?;
        Ok(())
    }

    async fn answer(
        self: &Arc<Self>,
        frame: ArrivedFrame,
        (session, queue): (SessionPermit, QueuePermit),
    ) -> Result<Given, Problem> {
        let ArrivedFrame {
            header,
            file,
            charge,
        } = frame;
        if self.newest_wins && header.frame.is_some() {
            let detail = "With drop=true frames are skipped, so they have no numbers.";
            return Err(Problem::malformed(detail));
        }
        if file.is_empty() {
            return Err(Problem::missing_frame());
        }
        let config = &self.state.config;
        let next = NextFrames {
            number: header.frame,
            files: vec![file],
            correction: header.r#box.map(Into::into),
            kept: MAX_KEPT.min(config.max_frames),
            sees: header.see,
        };
        let (limits, stream) = (config.request_limits(), self.clone());
        let advance = move |locked: &mut LockedSession, meter: &mut WorkMeter| {
            let _charge = charge;
            // The newer stream has told its client which frame is the next.
            if stream.place.is_replaced() {
                return Err(Problem::work_timeout());
            }
            next.advance(locked, &limits, meter, &stream.state.metrics.tracking)
        };
        let Answered {
            estimates,
            replayed,
            seen,
        } = work::on_session(&self.state, session, queue, advance).await?;
        Ok(Given {
            estimate: estimates[0],
            replayed,
            seen,
        })
    }
}
