//! The `{id}` of a session's path.

use super::problem::Problem;
use super::state::AppState;
use crate::sessions::{Place, Session};
use axum::extract::{FromRequestParts, Path};
use axum::http::request::Parts;
use std::sync::Arc;

/// The id as it stands in the path. It is looked up by [`SessionPath::find`], after the rest of the request head has
/// been checked.
pub struct SessionPath(String);

impl<S: Send + Sync> FromRequestParts<S> for SessionPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        // Bytes that are no text name no session.
        let path = Path::<String>::from_request_parts(parts, state).await;
        path.map(|Path(id)| Self(id))
            .map_err(|_| Problem::session_not_found())
    }
}

impl SessionPath {
    /// The live session of this id; that counts as use. Text that is no id names no session.
    pub fn find(&self, state: &AppState) -> Result<Arc<Session>, Problem> {
        let id = self.0.parse().ok();
        id.and_then(|id| state.registry.get(id))
            .ok_or_else(Problem::session_not_found)
    }
    /// A place at the session of this id.
    pub fn enter(&self, state: &AppState) -> Result<Place, Problem> {
        let session = self.find(state)?;
        session.enter().map_err(|_| Problem::session_busy())
    }
}
