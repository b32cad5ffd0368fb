//! A request with frames for a live session.

use super::admit::admit;
use super::settings::Settings;
use super::texts::Texts;
use super::uploaded::Upload;
use crate::http::problems::problem::Problem;
use crate::http::session_path::SessionPath;
use crate::http::state::AppState;
use crate::sessions::{QueuePermit, Session, SessionPermit};
use axum::extract::{FromRequest, FromRequestParts, Request};

/// A request with frames for a live session, with its permits.
#[derive(Debug)]
pub struct SessionRequest<S> {
    /// The permit of the session.
    pub permit: SessionPermit,
    /// The place in the queue.
    pub queue: QueuePermit,
    /// The frames and settings.
    pub upload: Upload<S>,
}

impl<S: Settings> FromRequest<AppState> for SessionRequest<S> {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &AppState) -> Result<Self, Problem> {
        let texts = Texts::of_query::<S>(request.uri())?;
        let (mut parts, body) = request.into_parts();
        let path = SessionPath::from_request_parts(&mut parts, state).await?;
        let permit = path.find(state)?.enter()?;
        let read = async {
            let client = admit(state, &parts)?;
            let request = Request::from_parts(parts, body);
            Upload::read(state, client, texts, request).await
        };
        let read = read.await;
        let (upload, queue) =
            read.inspect_err(|problem| renew_if_busy(permit.session(), problem))?;
        Ok(Self {
            permit,
            queue,
            upload,
        })
    }
}

/// A session lives on where there was no room or time for its frame. Otherwise a refused frame does not keep it alive.
pub fn renew_if_busy(session: &Session, problem: &Problem) {
    if problem.retry_seconds().is_some() {
        session.renew();
    }
}
