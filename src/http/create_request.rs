//! A request to open a session, as it is read.

use super::auth::caller::Caller;
use super::clients::Account;
use super::idempotency;
use super::problems::problem::Problem;
use super::state::AppState;
use super::target_box::{BoxInput, BoxText, TargetBox};
use super::upload::admit::admit;
use super::upload::overrides::{ParamOverrides, PresetName};
use super::upload::settings::{FrameCount, NumberInput, NumberText, Settings, WholeNumber};
use super::upload::texts::Texts;
use super::upload::uploaded::Upload;
use crate::sessions::{Fingerprint, QueuePermit};
use axum::extract::{FromRequest, FromRequestParts, Request};
use serde::Deserialize;
use std::sync::Arc;

/// The settings of a new session.
#[derive(Debug, Default, PartialEq, Deserialize, utoipa::IntoParams, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct CreateSettings {
    /// The target's box: `x,y,width,height`, or a JSON object with these names. In the query or in the
    /// body; that of the body counts.
    #[param(value_type = BoxText, inline, required = false, example = "10,20,30,40")]
    #[schema(value_type = BoxInput, inline, required = false)]
    pub r#box: Option<TargetBox>,
    /// `robust` (the default) or `paper`.
    #[param(nullable = false)]
    pub preset: Option<PresetName>,
    /// Seed of all random draws, which counts before that of `params`; a random one when left out.
    #[param(value_type = NumberText, inline, required = false)]
    #[schema(value_type = NumberInput, inline, required = false)]
    pub seed: Option<WholeNumber>,
    /// A JSON object of parameters that are set otherwise than in the preset. Each has a range, and some have a limit
    /// together; see the call.
    #[param(value_type = String, format = "json", required = false, example = "{\"seed\": 7}")]
    pub params: Option<ParamOverrides>,
}

impl Settings for CreateSettings {
    const FRAMES: FrameCount = FrameCount::One;
    const SCHEMA_PREFIX: &'static str = "Create";
}

/// A request to open a session, with its place in the queue.
#[derive(Debug)]
pub struct CreateRequest {
    /// Who opens it.
    pub caller: Caller,
    /// The idempotency key.
    pub key: Option<String>,
    /// What the client has in use.
    pub account: Arc<Account>,
    /// The place in the queue.
    pub queue: QueuePermit,
    /// The frame and the settings.
    pub upload: Upload<CreateSettings>,
}

impl FromRequest<AppState> for CreateRequest {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &AppState) -> Result<Self, Problem> {
        let texts = Texts::of_query::<CreateSettings>(request.uri())?;
        let (mut parts, body) = request.into_parts();
        let caller = Caller::from_request_parts(&mut parts, state).await?;
        caller.require_key()?;
        let key = idempotency::key_of(&parts.headers)?;
        // A request that comes again may have its answer already.
        if key.is_none() {
            check_room(state)?;
        }
        let client = admit(state, &parts)?;
        let account = client.account().clone();
        if key.is_none() {
            account.check_session()?;
        }
        let request = Request::from_parts(parts, body);
        let (upload, queue) = Upload::read(state, client, texts, request).await?;
        Ok(Self {
            caller,
            key,
            account,
            queue,
            upload,
        })
    }
}

impl CreateRequest {
    /// A digest of the frame and the settings, whichever form they came in. It is compared with others of this process
    /// only.
    pub fn digest(&self) -> blake3::Hash {
        let (file, upload) = (Fingerprint::of(&self.upload.files[0]), &self.upload);
        let text = format!("{file:?} {:?} {}", upload.settings, upload.is_snapshot);
        blake3::hash(text.as_bytes())
    }
}

/// Refuses new sessions where there is no room for them, or when the service is about to end.
///
/// # Errors
/// `too-many-sessions` and `not-ready`.
pub fn check_room(state: &AppState) -> Result<(), Problem> {
    if state.is_draining() {
        return Err(Problem::not_ready());
    }
    Ok(state.registry.check_room()?)
}
