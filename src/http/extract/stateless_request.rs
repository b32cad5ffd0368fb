//! A request that needs no session, with its place in the queue.

use super::caller::{Caller, client_of};
use super::instance::Instance;
use super::texts::Texts;
use super::uploaded::{Upload, admit};
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::extract::{FromRequest, FromRequestParts, Request};
use bagtrack_api::requests::Settings;
use bagtrack_quotas::Client;
use bagtrack_sessions::QueuePermit;

/// A request with files and settings and no session. A session token does not do.
#[derive(Debug)]
pub struct StatelessRequest<S> {
    /// Who sends it.
    pub client: Client,
    /// Names it to its client.
    pub instance: Instance,
    /// Its place in the queue.
    pub queue: QueuePermit,
    /// What it brings.
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
        let admitted = admit(state, &parts)?;
        let request = Request::from_parts(parts, body);
        let (upload, queue) = Upload::read(state, admitted, texts, request).await?;
        Ok(Self {
            client,
            instance,
            queue,
            upload,
        })
    }
}
