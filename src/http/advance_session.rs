//! A session's next frames, with the store where there is one: an answer is given after the store has its frame.
//!
//! The frames are tracked on a copy of the state. The copy becomes the session's state when the store has taken the
//! frame; so nothing needs to be undone when it does not. Where another replica was there first, the session goes on
//! from the store's state, and the frames are looked at again. Frames whose order nothing tells are refused then.

use super::advance::{Answered, NextFrames};
use super::client::Client;
use super::durability::Durability;
use super::newest;
use super::problems::kind::Kind;
use super::problems::problem::Problem;
use super::state::AppState;
use super::store_config::SharedStore;
use super::{stored, work};
use crate::sessions::{
    LockedSession, QueuePermit, Record, Reply, SessionBusy, SessionPermit, SessionState, StoreAway,
    Version, WorkMeter,
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
    let mut was_late = false;
    for _ in 0..MAX_ATTEMPTS {
        let outcome;
        (locked, outcome) = attempt(state, store, queue.clone(), locked, next.clone()).await?;
        let session = locked.session().clone();
        let lives = state.registry.idle_lease();
        let reply = match &outcome {
            Outcome::Tracked(tracked, _, bytes) => {
                write(
                    store,
                    &session.id(),
                    &locked,
                    tracked,
                    bytes.as_deref(),
                    lives,
                )
                .await
            }
            Outcome::Settled(Err(problem)) if !depends_on_state(problem) => {
                return Err(problem.clone());
            }
            Outcome::Settled(settled) => match session.version() {
                Some(version) => {
                    let lives = settled.is_ok().then_some(lives);
                    store.calls.check(session.id(), version, true, lives).await
                }
                None => Ok(Reply::Done(lives)),
            },
        };
        let lacks_frame = match reply {
            Ok(Reply::Done(_)) => false,
            Ok(Reply::Gone) => return Err(stored::gone(state, &session)),
            Ok(Reply::Other(record)) => {
                was_late |= matches!(outcome, Outcome::Tracked(..));
                stored::take_over(state, &mut locked, *record, client).await?;
                if is_unordered {
                    return Err(Problem::not_in_order());
                }
                continue;
            }
            Err(_) if store.best_effort => true,
            Err(away) => return Err(away.into()),
        };
        let durability = |session| match lacks_frame {
            true => Durability::lacking_frame(session),
            false => Durability::of(session),
        };
        if !matches!(outcome, Outcome::Settled(Err(_))) {
            session.renew();
        }
        return match outcome {
            Outcome::Tracked(tracked, mut answered, bytes) => {
                let version = session.version();
                let version = match lacks_frame {
                    true => version,
                    false => Some(version_after(&locked, version, &tracked, bytes.is_some())),
                };
                locked.replace(*tracked, version);
                answered.durability = durability(&session);
                Ok(answered)
            }
            // Another frame with its number won, at another replica.
            Outcome::Settled(Err(problem)) if was_late => {
                Err(problem.with_kind(Kind::FrameOutOfOrder))
            }
            Outcome::Settled(settled) => settled.map(|mut answered| {
                answered.durability = durability(&session);
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
                let is_due = |version: Version| frame >= version.checkpoint + every;
                let bytes = session.version().is_none_or(is_due);
                let bytes = bytes.then(|| tracked.stored());
                Outcome::Tracked(Box::new(tracked), answered, bytes)
            }
            settled => Outcome::Settled(settled),
        };
        Ok((locked, outcome))
    })
    .await
}

/// Moves the record on to the tracked state; makes one where there is none.
async fn write(
    store: &SharedStore,
    id: &uuid::Uuid,
    locked: &LockedSession,
    tracked: &SessionState,
    bytes: Option<&[u8]>,
    lives: std::time::Duration,
) -> Result<Reply, StoreAway> {
    let (session, frame) = (locked.session(), tracked.latest_frame());
    if let Some(before) = session.version() {
        return store.calls.advance(*id, before, frame, bytes, lives).await;
    }
    let record = Record {
        version: Version::first(session.opening(), frame),
        owner: session.owner().clone(),
        opening: session.opening().clone(),
        state: bytes.map(<[u8]>::to_vec).unwrap_or_default(),
        lives,
    };
    store.calls.create(*id, &record).await
}

fn version_after(
    locked: &LockedSession,
    before: Option<Version>,
    tracked: &SessionState,
    wrote_state: bool,
) -> Version {
    let frame = tracked.latest_frame();
    match before {
        None => Version::first(locked.session().opening(), frame),
        Some(before) if wrote_state => before.written(frame),
        Some(before) => Version { frame, ..before },
    }
}

/// Whether another state might have answered otherwise.
fn depends_on_state(problem: &Problem) -> bool {
    matches!(problem.kind(), Kind::FrameOutOfOrder | Kind::FrameDiffers)
}
