//! The `{id}` of a session's path.

use super::problems::problem::Problem;
use super::state::AppState;
use crate::sessions::Session;
use axum::extract::{FromRequestParts, Path};
use axum::http::request::Parts;
use std::sync::Arc;

/// The id as it stands in the path. It is looked up by [`SessionPath::find`], after the rest of the request head has
/// been checked.
pub struct SessionPath(String);

impl<S: Send + Sync> FromRequestParts<S> for SessionPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        // Bytes that are not UTF-8 are the id of no session.
        let path = Path::<String>::from_request_parts(parts, state).await;
        path.map(|Path(id)| Self(id))
            .map_err(|_| Problem::session_not_found())
    }
}

impl SessionPath {
    /// The live session of this id, which counts as use. Text that is not an id is the id of no session.
    pub fn find(&self, state: &AppState) -> Result<Arc<Session>, Problem> {
        let id = self.0.parse().ok();
        id.and_then(|id| state.registry.get(id))
            .ok_or_else(Problem::session_not_found)
    }
}
