//! Having a session's newest state in memory, and keeping its record alive.
//!
//! Memory is a cache of the store: another replica may have gone on with a session that is in memory here.

use super::state::AppState;
use super::stored;
use super::work;
use crate::http::problems::kind::Kind;
use crate::http::problems::problem::Problem;
use crate::http::quotas::client::Client;
use crate::sessions::{
    LockedSession, QueuePermit, Reply, Session, SessionBusy, SessionPermit, WorkMeter,
};
use std::sync::Arc;
use tokio::time::timeout;

/// How often a session is fenced: other replicas may be there first each time.
const MAX_ATTEMPTS: usize = 4;

/// Waits for the session, and brings its state up to the store's. `goes_on` says that frames follow here.
///
/// # Errors
/// The session has ended, or the store gives no answer.
pub async fn lock(
    state: &AppState,
    permit: SessionPermit,
    client: &Client,
    goes_on: bool,
) -> Result<LockedSession, Problem> {
    let mut locked = permit.lock().await?;
    let (Some(store), Some(version)) = (&state.store, locked.session().version()) else {
        return Ok(locked);
    };
    let name = locked.session().name();
    match store.calls.check(name, version, goes_on, None).await {
        Ok(Reply::Done(lives)) => locked.session().set_lives(lives),
        Ok(Reply::Ended) => return Err(stored::ended(state, locked.session())),
        Ok(Reply::Missing) => return Err(stored::missing(state, locked.session())),
        Ok(Reply::Other(record)) => stored::take_over(state, &mut locked, *record, client).await?,
        Err(away) => return Err(away.into()),
    }
    Ok(locked)
}

/// Waits for the session as long as a request may, brings its state up to the store's, and runs `work` with it on a
/// worker.
///
/// # Errors
/// See [`lock`], and those of the work.
pub async fn look<T, F>(
    state: &AppState,
    permit: SessionPermit,
    queue: QueuePermit,
    client: &Client,
    work: F,
) -> Result<T, Problem>
where
    T: Send + 'static,
    F: FnOnce(&mut LockedSession) -> Result<T, Problem> + Send + 'static,
{
    let newest = lock(state, permit, client, false);
    let newest = timeout(state.config.work_timeout, newest).await;
    let mut locked = newest.map_err(|_| Problem::work_timeout())??;
    work::run(state, queue, move |_: &mut WorkMeter| work(&mut locked)).await
}

/// Whether the store has another version than memory. Waits for no frame that is being tracked here.
async fn is_behind(state: &AppState, session: &Arc<Session>) -> Result<bool, Problem> {
    let (Some(store), Some(version)) = (&state.store, session.version()) else {
        return Ok(false);
    };
    match store
        .calls
        .check(session.name(), version, false, None)
        .await
    {
        Ok(Reply::Done(lives)) => session.set_lives(lives),
        Ok(Reply::Ended) => return Err(stored::ended(state, session)),
        Ok(Reply::Missing) => return Err(stored::missing(state, session)),
        // It may be this replica that is about to note the newer frame.
        Ok(Reply::Other(_)) => return Ok(true),
        Err(away) => return Err(away.into()),
    }
    Ok(false)
}

/// Brings the last answer of a session up to the store's.
///
/// # Errors
/// The session has ended, or the store gives no answer.
pub async fn refresh(
    state: &AppState,
    session: &Arc<Session>,
    client: &Client,
) -> Result<(), Problem> {
    if is_behind(state, session).await? {
        drop(lock(state, session.visit()?, client, false).await?);
    }
    Ok(())
}

/// The same for a request that is at the session already.
///
/// # Errors
/// See [`refresh`].
pub async fn catch_up(
    state: &AppState,
    permit: &SessionPermit,
    client: &Client,
) -> Result<(), Problem> {
    if is_behind(state, permit.session()).await? {
        drop(lock(state, permit.visitor(), client, false).await?);
    }
    Ok(())
}

/// Waits for the session with its newest state, and lets no other replica go on from its own copy.
///
/// # Errors
/// The session has ended, or the store gives no answer.
pub async fn lock_fenced(
    state: &AppState,
    permit: SessionPermit,
    client: &Client,
) -> Result<LockedSession, Problem> {
    let mut locked = permit.lock().await?;
    let Some(store) = &state.store else {
        return Ok(locked);
    };
    for _ in 0..MAX_ATTEMPTS {
        let Some(version) = locked.session().version() else {
            return Ok(locked);
        };
        match store.calls.fence(locked.session().name(), version).await {
            Ok(Reply::Done(lives)) => {
                locked.session().set_lives(lives);
                locked.fenced();
                return Ok(locked);
            }
            Ok(Reply::Ended) => return Err(stored::ended(state, locked.session())),
            Ok(Reply::Missing) => return Err(stored::missing(state, locked.session())),
            Ok(Reply::Other(record)) => {
                stored::take_over(state, &mut locked, *record, client).await?;
            }
            Err(away) => return Err(away.into()),
        }
    }
    Err(SessionBusy.into())
}

/// A session lives on where there was no room or time for its frame. Otherwise a refused frame does not keep it alive.
pub async fn renew_if_busy(state: &AppState, session: &Session, problem: &Problem) {
    if problem.retry_seconds().is_none() {
        return;
    }
    session.renew();
    if let (Some(store), Some(version)) = (&state.store, session.version())
        && problem.kind() != Kind::StoreUnavailable
    {
        let lives = Some(state.registry.idle_lease());
        // Without an answer it lives as long as before.
        let _ = store
            .calls
            .check(session.name(), version, false, lives)
            .await;
    }
}
