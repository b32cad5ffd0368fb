//! A request to look at a session's state, on a worker.

use super::caller::client_of;
use super::session_path::SessionPath;
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use bagtrack_sessions::{Charge, QueuePermit, SessionPermit};

/// A request to look at a session's state, with its permits.
#[derive(Debug)]
pub struct ReadRequest<Q> {
    /// The settings, read first.
    pub query: Q,
    /// The permit of the session.
    pub permit: SessionPermit,
    /// The place in the queue.
    pub queue: QueuePermit,
    /// Pays for the answer; nothing so far.
    pub charge: Charge,
}

impl<Q: FromRequestParts<AppState, Rejection = Problem> + Send> FromRequestParts<AppState>
    for ReadRequest<Q>
{
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, Problem> {
        let query = Q::from_request_parts(parts, state).await?;
        let path = SessionPath::from_request_parts(parts, state).await?;
        let session = path.find(state).await?;
        let admission = &state.service.admission;
        let client = client_of(parts);
        let account = state.clients.account(&client);
        admission.check_place(account.flow())?;
        let request = account.request()?;
        let queue = admission.enter(request.flow(), Box::new(request))?;
        Ok(Self {
            query,
            permit: session.read_permit()?,
            queue,
            charge: state.charge(&client),
        })
    }
}
