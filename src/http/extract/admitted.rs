//! Requests that are let in, with their permits: frames for a live session, files for no session, and a look at a
//! session's state.

use super::answer_form::AnswerForm;
use super::caller::{Caller, SessionPath, client_of};
use super::instance::Instance;
use super::texts::Texts;
use super::uploaded::Upload;
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::extract::{FromRequest, FromRequestParts, Request};
use axum::http::request::Parts;
use bagtrack_api::requests::Settings;
use bagtrack_quotas::Client;
use bagtrack_sessions::{Charge, QueuePermit, SessionPermit};

/// A request with frames for a live session, with its permits.
#[derive(Debug)]
pub struct SessionRequest<S> {
    pub client: Client,
    pub form: AnswerForm,
    pub instance: Instance,
    pub permit: SessionPermit,
    pub queue: QueuePermit,
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
        let (upload, queue) = match Upload::read(state, texts, parts, body).await {
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

/// A request with files and settings and no session. A session token does not do.
#[derive(Debug)]
pub struct StatelessRequest<S> {
    pub client: Client,
    pub instance: Instance,
    pub queue: QueuePermit,
    pub upload: Upload<S>,
}

impl<S: Settings> FromRequest<AppState> for StatelessRequest<S> {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &AppState) -> Result<Self, Problem> {
        let texts = Texts::of_query::<S>(request.uri())?;
        let instance = Instance::of(&request);
        let (mut parts, body) = request.into_parts();
        let caller = Caller::from_request_parts(&mut parts, state).await?;
        caller.require_key()?;
        let client = client_of(&parts);
        let (upload, queue) = Upload::read(state, texts, parts, body).await?;
        Ok(Self {
            client,
            instance,
            queue,
            upload,
        })
    }
}

/// A request to look at a session's state, with its permits.
#[derive(Debug)]
pub struct ReadRequest<Q> {
    /// The settings, read first.
    pub query: Q,
    pub permit: SessionPermit,
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
