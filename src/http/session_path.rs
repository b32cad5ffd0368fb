//! The `{id}` of a session's path.

use super::auth::caller::Caller;
use super::problems::problem::Problem;
use super::state::AppState;
use crate::sessions::Session;
use axum::extract::{FromRequestParts, Path};
use axum::http::request::Parts;
use std::sync::Arc;

/// The id as it stands in the path, and who asks for it. It is looked up by [`SessionPath::find`], after the rest of the
/// request head has been checked.
pub struct SessionPath {
    id: String,
    caller: Caller,
}

impl<S: Send + Sync> FromRequestParts<S> for SessionPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        // Bytes that are not UTF-8 are the id of no session.
        let caller = Caller::from_request_parts(parts, state).await?;
        let path = Path::<String>::from_request_parts(parts, state).await;
        path.map(|Path(id)| Self { id, caller })
            .map_err(|_| Problem::session_not_found())
    }
}

impl SessionPath {
    /// The caller's live session of this id. Text that is not an id is the id of no session.
    pub fn find(&self, state: &AppState) -> Result<Arc<Session>, Problem> {
        match self.id.parse() {
            Ok(id) if self.caller.may_use(id) => {
                Ok(state.registry.find(id, self.caller.owner())?)
            }
            _ => Err(Problem::session_not_found()),
        }
    }
}
