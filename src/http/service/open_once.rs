//! Opens a session once: a request that comes again under the same name gets the same answer.

use super::idempotency::OpeningName;
use super::opening::{created, open};
use super::state::AppState;
use super::stored;
use crate::http::problems::kind::Kind;
use crate::http::problems::problem::Problem;
use crate::http::resources::create_request::{CreateRequest, check_room};
use crate::sessions::{Owner, Session};
use axum::response::Response;
use tokio::time::timeout;
use uuid::Uuid;

/// The answer to a request to open a session.
///
/// # Errors
/// The session cannot be opened, or another request has opened one under this name.
pub async fn open_once(state: &AppState, request: CreateRequest) -> Result<Response, Problem> {
    let is_verbose = request.upload.settings.verbose.0;
    let Some(name) = request.name.clone() else {
        let session = open(state, request, Uuid::new_v4()).await?;
        return Ok(created(&session, false, is_verbose));
    };
    let is_live = |id| state.registry.is_live(id);
    let entry = state.opened.entry(name.clone(), is_live);
    // Another request of this name may be about to open the session.
    let locked = timeout(state.config.work_timeout, entry.lock_owned());
    let mut opened = locked.await.map_err(|_| Problem::work_timeout())?;
    let id = match &name {
        OpeningName::Id(id) => *id,
        OpeningName::Key(owner, key) => id_of_key(state, owner, key, *opened).await?,
    };
    let client = request.client.clone();
    if let Some(session) = stored::live(state, id, &client).await? {
        is_same(&session, request.caller.owner(), request.digest(), &name)?;
        return Ok(created(&session, true, is_verbose));
    }
    check_room(state, &request.account)?;
    let (caller, digest) = (request.caller.clone(), request.digest());
    match open(state, request, id).await {
        // Another replica was first.
        Err(problem) if problem.kind() == Kind::SessionExists => {
            let session = stored::live(state, id, &client).await?;
            let session = session.ok_or(problem)?;
            is_same(&session, caller.owner(), digest, &name)?;
            Ok(created(&session, true, is_verbose))
        }
        session => {
            let session = session?;
            *opened = Some(session.id());
            Ok(created(&session, false, is_verbose))
        }
    }
}

/// The id of the session that an idempotency key names: of the one that is open, or a new one. With a store, all
/// replicas find the same.
async fn id_of_key(
    state: &AppState,
    owner: &Owner,
    key: &str,
    opened: Option<Uuid>,
) -> Result<Uuid, Problem> {
    if let Some(live) = opened.filter(|id| state.registry.is_live(*id)) {
        return Ok(live);
    }
    let new = Uuid::new_v4();
    match &state.store {
        None => Ok(new),
        Some(store) => Ok(store.calls.claim(owner, key, new).await?),
    }
}

/// Whether the open session of this name was opened by the same request.
fn is_same(
    session: &Session,
    owner: &Owner,
    digest: [u8; 32],
    name: &OpeningName,
) -> Result<(), Problem> {
    let same = session.owner() == owner && session.opening().request == digest;
    match (same, name) {
        (true, _) => Ok(()),
        (false, OpeningName::Id(_)) => Err(Problem::session_exists()),
        (false, OpeningName::Key(..)) => Err(Problem::idempotency_key_reused()),
    }
}
