//! A session's next frames, with the store where there is one: an answer is given after the store has its frame.
//!
//! The frames are tracked on a copy of the state. The copy becomes the session's state when the store has taken the
//! frame; so nothing needs to be undone when it does not. Where another replica was there first, the session goes on
//! from the store's state, and the frames are looked at again. Frames whose order nothing tells are refused then.

use super::advance::{Answered, NextFrames};
use super::newest;
use super::state::AppState;
use super::stored;
use super::work;
use crate::http::config::store::SharedStore;
use crate::http::problems::kind::Kind;
use crate::http::problems::problem::Problem;
use crate::http::quotas::client::Client;
use crate::sessions::{
    LockedSession, QueuePermit, Reply, SessionBusy, SessionPermit, SessionState, Version, WorkMeter,
};
use std::sync::Arc;
use tokio::time::timeout;

/// How often the frames of one request are looked at: other replicas may be there first each time.
const MAX_ATTEMPTS: usize = 4;

/// What came of the frames.
enum Outcome {
    /// They were tracked, up to this state; its bytes are there where they are to be written.
    Tracked(Box<SessionState>, Answered, Option<Vec<u8>>),
    /// There was nothing to track.
    Settled(Result<Answered, Problem>),
}

/// The answers to the next frames of a session.
///
/// # Errors
/// The problem of the first bad frame, of the frame number, or of the store. The session is unchanged.
pub async fn advance_session(
    state: &AppState,
    permit: SessionPermit,
    queue: QueuePermit,
    client: &Client,
    next: NextFrames,
) -> Result<Answered, Problem> {
    let (session, is_posted) = (permit.session().clone(), next.stream.is_none());
    let answered = match &state.store {
        Some(store) => {
            let advanced = advance_stored(state, store, permit, queue, client, Arc::new(next));
            let advanced = timeout(state.config.work_timeout, advanced).await;
            advanced.unwrap_or_else(|_| Err(Problem::work_timeout()))
        }
        None => {
            let limits = state.config.request_limits();
            let metrics = state.metrics.tracking.clone();
            let advance = move |locked: &mut LockedSession, meter: &mut WorkMeter| {
                next.advance(locked, &limits, meter, &metrics)
            };
            work::on_session(state, permit, queue, advance).await
        }
    };
    if let Err(problem) = &answered
        && is_posted
    {
        newest::renew_if_busy(state, &session, problem).await;
    }
    answered
}

async fn advance_stored(
    state: &AppState,
    store: &SharedStore,
    permit: SessionPermit,
    queue: QueuePermit,
    client: &Client,
    next: Arc<NextFrames>,
) -> Result<Answered, Problem> {
    let is_unordered = next.number.is_none() && next.stream.is_none();
    let mut locked = match is_unordered {
        true => newest::lock(state, permit, client, true).await?,
        false => permit.lock().await?,
    };
    // Whether another frame was there first, and whether the state is what the store told.
    let (mut was_late, mut is_told) = (false, false);
    for _ in 0..MAX_ATTEMPTS {
        let outcome;
        let queue = queue.clone();
        (locked, outcome) = attempt(state, store, queue, locked, next.clone()).await?;
        let session = locked.session().clone();
        let idle = state.registry.idle_lease();
        let (name, before) = (
            session.name(),
            session.version().unwrap_or(Version::first(0)),
        );
        let (reply, after) = match &outcome {
            Outcome::Tracked(tracked, _, bytes) => {
                let frame = tracked.latest_frame();
                // A frame that comes late, after others that only another replica has, takes nothing back.
                let goes_on = is_told || next.number.is_none();
                let bytes = bytes.as_deref();
                let advanced = store
                    .calls
                    .advance(name, before, frame, bytes, goes_on, idle);
                let after = match bytes {
                    Some(_) => before.written(frame),
                    None => Version { frame, ..before },
                };
                (advanced.await?, after)
            }
            Outcome::Settled(Err(problem)) if !depends_on_state(problem) => {
                return Err(problem.clone());
            }
            Outcome::Settled(settled) => {
                let latest = locked.state().latest_frame();
                let is_past = next.number.is_some_and(|number| number <= latest);
                let lives = settled.is_ok().then_some(idle);
                let checked = store.calls.check(name, before, !is_past, lives).await?;
                match checked {
                    // The store may have later frames that only another replica has; this one is before them.
                    Reply::Other(_) if is_past && is_told => (Reply::Done(idle), before),
                    checked => (checked, before),
                }
            }
        };
        match reply {
            Reply::Done(_) => {}
            Reply::Ended => return Err(stored::ended(state, &session)),
            Reply::Missing => return Err(stored::missing(state, &session)),
            Reply::Other(record) => {
                was_late |= matches!(outcome, Outcome::Tracked(..));
                is_told = true;
                stored::take_over(state, &mut locked, *record, client).await?;
                if is_unordered {
                    return Err(Problem::not_in_order());
                }
                continue;
            }
        }
        if !matches!(outcome, Outcome::Settled(Err(_))) {
            session.renew();
        }
        return match outcome {
            Outcome::Tracked(tracked, mut answered, _) => {
                locked.replace(*tracked, Some(after));
                answered.checkpoint = session.checkpoint();
                Ok(answered)
            }
            // Another frame with its number won, at another replica.
            Outcome::Settled(Err(problem)) if was_late => {
                Err(problem.with_kind(Kind::FrameOutOfOrder))
            }
            Outcome::Settled(settled) => settled.map(|mut answered| {
                answered.checkpoint = session.checkpoint();
                answered
            }),
        };
    }
    Err(SessionBusy.into())
}

/// Looks at the frames on a worker.
async fn attempt(
    state: &AppState,
    store: &SharedStore,
    queue: QueuePermit,
    mut locked: LockedSession,
    next: Arc<NextFrames>,
) -> Result<(LockedSession, Outcome), Problem> {
    let limits = state.config.request_limits();
    let metrics = state.metrics.tracking.clone();
    // What is in memory only would be lost soon.
    let every = if state.is_draining() { 1 } else { store.every };
    work::run(state, queue, move |meter| {
        let session = locked.session().clone();
        next.check_stream(&session)?;
        let mut tracked = locked.state().clone();
        let outcome = match next.advance_state(&mut tracked, &limits, meter, &metrics) {
            Ok(answered) if !answered.replayed => {
                let frame = tracked.latest_frame();
                let is_due = |checkpoint| frame >= checkpoint + every;
                let bytes = session.checkpoint().is_none_or(is_due);
                let bytes = bytes.then(|| tracked.stored());
                Outcome::Tracked(Box::new(tracked), answered, bytes)
            }
            settled => Outcome::Settled(settled),
        };
        Ok((locked, outcome))
    })
    .await
}

/// Whether another state might have answered otherwise.
fn depends_on_state(problem: &Problem) -> bool {
    matches!(problem.kind(), Kind::FrameOutOfOrder | Kind::FrameDiffers)
}
