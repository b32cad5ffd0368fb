//! A request with frames for a live session.

use super::caller::client_of;
use super::instance::Instance;
use super::texts::Texts;
use super::uploaded::Upload;
use super::uploaded::admit;
use crate::http::extract::answer_form::AnswerForm;
use crate::http::extract::session_path::SessionPath;
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::extract::{FromRequest, FromRequestParts, Request};
use bagtrack_api::requests::Settings;
use bagtrack_quotas::Client;
use bagtrack_sessions::{QueuePermit, SessionPermit};

/// A request with frames for a live session, with its permits.
#[derive(Debug)]
pub struct SessionRequest<S> {
    /// Who sends it.
    pub client: Client,
    /// The form of the answer.
    pub form: AnswerForm,
    /// What names it to its client.
    pub instance: Instance,
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
        let instance = Instance::of(&request);
        let (mut parts, body) = request.into_parts();
        let path = SessionPath::from_request_parts(&mut parts, state).await?;
        let permit = path.find(state).await?.enter()?;
        let (client, form) = (client_of(&parts), AnswerForm::of(&parts.headers));
        let read = async {
            let admitted = admit(state, &parts)?;
            let request = Request::from_parts(parts, body);
            Upload::read(state, admitted, texts, request).await
        };
        let (upload, queue) = match read.await {
            Ok(read) => read,
            Err(problem) => {
                if problem.retry_seconds().is_some() {
                    state.service.renew(permit.session(), true).await;
                }
                return Err(problem);
            }
        };
        Ok(Self {
            client,
            form,
            instance,
            permit,
            queue,
            upload,
        })
    }
}
