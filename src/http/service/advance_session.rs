//! A session's next frames, with the store where there is one: an answer is given after the store has its frame.
//!
//! The frames are tracked on a copy of the state. The copy becomes the session's state when the store has taken the
//! frame; so nothing needs to be undone when it does not. Where another replica was there first, the session goes on
//! from the store's state, and the frames are looked at again. Frames whose order nothing tells are refused then.

use super::advance::{Answered, NextFrames};
use super::newest;
use super::state::AppState;
use super::stored;
use super::stored_writes::{Written, write};
use super::work;
use crate::http::config::store::SharedStore;
use crate::http::problems::kind::Kind;
use crate::http::problems::problem::Problem;
use crate::http::quotas::client::Client;
use crate::http::respond::durability::Durability;
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
    // Whether another frame was there first, the state is what the store told, and the store has lost the record.
    let (mut was_late, mut is_told, mut is_lost) = (false, false, false);
    for _ in 0..MAX_ATTEMPTS {
        let outcome;
        let queue = queue.clone();
        (locked, outcome) = attempt(state, store, queue, locked, next.clone(), is_lost).await?;
        let session = locked.session().clone();
        let idle = state.registry.idle_lease();
        let reply = match &outcome {
            Outcome::Tracked(tracked, _, bytes) => {
                let written = Written {
                    frame: tracked.latest_frame(),
                    bytes: bytes.as_deref(),
                    is_lost,
                    // A frame that comes late, after others that only another replica has, takes nothing back.
                    goes_on: is_told || next.number.is_none(),
                    lives: idle,
                };
                write(store, &session, written).await
            }
            Outcome::Settled(Err(problem)) if !depends_on_state(problem) => {
                return Err(problem.clone());
            }
            Outcome::Settled(settled) => match session.version() {
                Some(version) => {
                    let latest = locked.state().latest_frame();
                    let is_past = next.number.is_some_and(|number| number <= latest);
                    let (name, lives) = (session.name(), settled.is_ok().then_some(idle));
                    let checked = store.calls.check(name, version, !is_past, lives).await;
                    match checked {
                        // The store may have later frames that only another replica has; this one is before them.
                        Ok(Reply::Other(_)) if is_past && is_told => {
                            Ok((Reply::Done(idle), version))
                        }
                        checked => checked.map(|reply| (reply, version)),
                    }
                }
                // Whatever was answered is written, so this is a problem, of a session that only this replica has.
                None => Ok((Reply::Done(idle), Version::first(0))),
            },
        };
        let version = match reply {
            Ok((Reply::Done(_), version)) => Some(version),
            Ok((Reply::Ended, _)) => return Err(stored::ended(state, &session)),
            Ok((Reply::Missing, _)) => {
                stored::missing(state, &session)?;
                let latest = locked.state().latest_frame();
                match outcome {
                    // The client has got further answers: another replica may have a later state.
                    Outcome::Settled(Err(_)) if next.number > Some(latest + 1) => {
                        return Err(Problem::record_lost(latest));
                    }
                    Outcome::Settled(Err(problem)) => return Err(problem),
                    _ => is_lost = true,
                }
                continue;
            }
            Ok((Reply::Other(record), _)) => {
                was_late |= matches!(outcome, Outcome::Tracked(..));
                (is_told, is_lost) = (true, false);
                stored::take_over(state, &mut locked, *record, client).await?;
                if is_unordered {
                    return Err(Problem::not_in_order());
                }
                continue;
            }
            // The frame is in memory only.
            Err(_) if store.best_effort => session.version(),
            Err(away) => return Err(away.into()),
        };
        if !matches!(outcome, Outcome::Settled(Err(_))) {
            session.renew();
        }
        return match outcome {
            Outcome::Tracked(tracked, mut answered, _) => {
                let is_new = is_lost || session.version().is_none();
                locked.replace(*tracked, version);
                if let (true, Some(stream)) = (is_new, &next.stream) {
                    stream.begin(&session);
                }
                answered.durability = Durability::of(&session, true);
                Ok(answered)
            }
            // Another frame with its number won, at another replica.
            Outcome::Settled(Err(problem)) if was_late => {
                Err(problem.with_kind(Kind::FrameOutOfOrder))
            }
            Outcome::Settled(settled) => settled.map(|mut answered| {
                answered.durability = Durability::of(&session, true);
                answered
            }),
        };
    }
    Err(SessionBusy.into())
}

/// Looks at the frames on a worker. What the store has not, or has lost, is written, also where it was answered before.
async fn attempt(
    state: &AppState,
    store: &SharedStore,
    queue: QueuePermit,
    mut locked: LockedSession,
    next: Arc<NextFrames>,
    is_lost: bool,
) -> Result<(LockedSession, Outcome), Problem> {
    let limits = state.config.request_limits();
    let metrics = state.metrics.tracking.clone();
    // What is in memory only would be lost soon.
    let every = if state.is_draining() { 1 } else { store.every };
    work::run(state, queue, move |meter| {
        let session = locked.session().clone();
        next.check_stream(&session)?;
        let mut tracked = locked.state().clone();
        let version = session.version().filter(|_| !is_lost);
        let is_stored = version.is_some_and(|version| version.frame >= tracked.latest_frame());
        let outcome = match next.advance_state(&mut tracked, &limits, meter, &metrics) {
            Ok(answered) if !(answered.replayed && is_stored) => {
                let frame = tracked.latest_frame();
                let is_due = |version: Version| frame >= version.checkpoint + every;
                let bytes = version.is_none_or(is_due).then(|| tracked.stored());
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
