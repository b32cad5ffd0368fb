//! The `{id}` of a session's path.

use super::caller::{Caller, client_of};
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::extract::{FromRequestParts, Path};
use axum::http::request::Parts;
use bagtrack_quotas::Client;
use bagtrack_sessions::Session;
use std::sync::Arc;
use uuid::Uuid;

/// The id as it stands in the path, and who asks for it. It is looked up by [`SessionPath::find`], after the rest of
/// the request head has been checked.
pub struct SessionPath {
    id: String,
    caller: Caller,
    client: Client,
}

impl<S: Send + Sync> FromRequestParts<S> for SessionPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        // Bytes that are not UTF-8 are the id of no session.
        let caller = Caller::from_request_parts(parts, state).await?;
        let path = Path::<String>::from_request_parts(parts, state).await;
        let client = client_of(parts);
        path.map(|Path(id)| Self { id, caller, client })
            .map_err(|_| Problem::session_not_found())
    }
}

impl SessionPath {
    /// The caller's live session of this id. Text that is not an id is the id of no session.
    pub async fn find(&self, state: &AppState) -> Result<Arc<Session>, Problem> {
        let flow = state.flow(&self.client);
        self.caller.find(state, self.id()?, flow).await
    }

    /// The same, with its last answer up to the store's.
    pub async fn find_newest(&self, state: &AppState) -> Result<Arc<Session>, Problem> {
        let session = self.find(state).await?;
        let flow = state.flow(&self.client);
        state.service.refresh(&session, None, flow).await?;
        Ok(session)
    }

    pub async fn end(&self, state: &AppState) -> Result<(), Problem> {
        self.find(state).await?;
        let (owner, flow) = (self.caller.owner(), state.flow(&self.client));
        Ok(state.service.end(self.id()?, owner, flow).await?)
    }

    fn id(&self) -> Result<Uuid, Problem> {
        let id = self.id.parse().ok();
        let id = id.filter(|id| self.caller.may_ask_for(*id));
        id.ok_or_else(Problem::session_not_found)
    }
}
