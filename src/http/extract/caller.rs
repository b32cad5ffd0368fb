//! Who makes a request, and the session that it names in its path.

use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::extract::{FromRequestParts, Path};
use axum::http::request::Parts;
use bagtrack_access::Credential;
use bagtrack_quotas::Client;
use bagtrack_sessions::{Flow, Owner, Session, SessionName};
use std::io;
use std::net::Ipv4Addr;
use std::sync::Arc;
use uuid::Uuid;

/// Who makes a request, as [`authenticate`](crate::http::middleware::authenticate::authenticate) has found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Caller {
    credential: Credential,
    /// The only session that may be used, where the request came with a session token.
    only: Option<SessionName>,
}

impl Caller {
    /// Whoever has this API key, or this token of an identity provider.
    pub fn with_key(credential: Credential) -> Self {
        Self {
            credential,
            only: None,
        }
    }

    pub fn with_token(session: SessionName, credential: Credential) -> Self {
        Self {
            credential,
            only: Some(session),
        }
    }

    pub fn credential(&self) -> &Credential {
        &self.credential
    }

    /// The owner whose sessions the caller may use.
    pub fn owner(&self) -> &Owner {
        &self.credential.owner
    }

    /// The id of the only session that may be used, where the request came with a session token.
    pub fn page_of(&self) -> Option<Uuid> {
        self.only.map(|only| only.id)
    }

    /// Whether no session token stands against the use of this session. [`Self::find`] checks the owner, too.
    pub fn may_ask_for(&self, id: Uuid) -> bool {
        self.only.is_none_or(|only| only.id == id)
    }

    /// The owner's live session of this id.
    ///
    /// # Errors
    /// The owner has no such session, the session token is for another one, or the store gives no answer.
    pub async fn find(
        &self,
        state: &AppState,
        id: Uuid,
        flow: Flow,
    ) -> Result<Arc<Session>, Problem> {
        let session = state.service.find(id, self.owner(), flow).await?;
        match self.only.is_none_or(|only| only == session.name()) {
            true => Ok(session),
            false => Err(Problem::session_not_found()),
        }
    }

    /// Refuses a caller with a session token, for what such a token is not good for.
    ///
    /// # Errors
    /// The request came with a session token.
    pub fn require_key(&self) -> Result<(), Problem> {
        match self.only {
            None => Ok(()),
            Some(_) => Err(Problem::forbidden()),
        }
    }
}

/// The client of a request that has passed [the middleware that notes it](crate::http::middleware::client_quotas).
pub fn client_of(parts: &Parts) -> Client {
    let client = parts.extensions.get::<Client>().cloned();
    client.unwrap_or_else(|| Client::at(Ipv4Addr::UNSPECIFIED.into()))
}

impl<S: Send + Sync> FromRequestParts<S> for Caller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> Result<Self, Problem> {
        // A route without the middleware serves nobody.
        let missing = || io::Error::other("no middleware has identified the caller");
        let caller = parts.extensions.get::<Self>().cloned();
        caller.ok_or_else(|| Problem::internal(Arc::new(missing())))
    }
}

/// The id of a session as it stands in the path, and who asks for it. The session is looked up by
/// [`SessionPath::find`], after the rest of the request head has been checked.
pub struct SessionPath {
    id: String,
    caller: Caller,
    client: Client,
}

impl<S: Send + Sync> FromRequestParts<S> for SessionPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        // A path that is not UTF-8 is answered like an unknown id.
        let caller = Caller::from_request_parts(parts, state).await?;
        let path = Path::<String>::from_request_parts(parts, state).await;
        let client = client_of(parts);
        path.map(|Path(id)| Self { id, caller, client })
            .map_err(|_| Problem::session_not_found())
    }
}

impl SessionPath {
    /// The caller's live session of this id. Text that is no UUID is answered like an unknown id.
    pub async fn find(&self, state: &AppState) -> Result<Arc<Session>, Problem> {
        let flow = state.flow(&self.client);
        self.caller.find(state, self.id()?, flow).await
    }

    /// Like [`Self::find`], with the session's last answer brought up to the store's.
    pub async fn find_newest(&self, state: &AppState) -> Result<Arc<Session>, Problem> {
        let session = self.find(state).await?;
        let flow = state.flow(&self.client);
        state.service.refresh(&session, None, flow).await?;
        Ok(session)
    }

    pub async fn end(&self, state: &AppState) -> Result<(), Problem> {
        let (owner, only) = (self.caller.owner(), self.caller.only);
        Ok(state.service.end(self.id()?, owner, only).await?)
    }

    fn id(&self) -> Result<Uuid, Problem> {
        let id = self.id.parse().ok();
        let id = id.filter(|id| self.caller.may_ask_for(*id));
        id.ok_or_else(Problem::session_not_found)
    }
}
