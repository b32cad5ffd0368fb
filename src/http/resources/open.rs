//! `POST /sessions` and `PUT /sessions/{id}`: a first frame and a box, or a snapshot, open a session.

use crate::http::extract::admitted::Upload;
use crate::http::extract::caller::{Caller, client_of};
use crate::http::extract::instance::idempotency_key;
use crate::http::extract::overrides;
use crate::http::extract::texts::Texts;
use crate::http::problems::problem::Problem;
use crate::http::respond::answer::created;
use crate::http::state::AppState;
use axum::extract::{FromRequest, FromRequestParts, Path, Request, State};
use axum::http::request::Parts;
use axum::response::Response;
use bagtrack_api::CreatedSession;
use bagtrack_api::openapi::{create_description, example_frames};
use bagtrack_api::requests::{BinaryBody, CreateSettings, FormBody, JsonBody};
use bagtrack_quotas::{Account, Client, ClientSessions};
use bagtrack_sessions::{CreationKey, OpenRequest, QueuePermit, Start, is_snapshot};
use serde_json::json;
use std::sync::Arc;
use uuid::Uuid;

/// The number of the digest's format, which is digested, too.
const DIGEST_FORMAT: u8 = 1;

type CreateForm = FormBody<CreateSettings>;
type CreateJson = JsonBody<CreateSettings>;

/// Open a session
#[utoipa::path(
    post, path = "/sessions", tag = "sessions", operation_id = "createSession",
    description = create_description(),
    params(
        CreateSettings,
        (
            "Idempotency-Key" = Option<String>, Header, nullable = false, min_length = 1, max_length = 255,
            pattern = "^[!-~]+$",
            description = "A text of your own, a new one for each session: the same request with the same key gets \
                the same answer as long as the session lives, and opens no second one."
        )
    ),
    request_body(
        description = "The first frame as a raw body (JPEG, PNG or WebP), as a form, or as JSON with base64; or a snapshot.",
        content(
            (BinaryBody = "application/octet-stream"),
            (CreateForm = "multipart/form-data"),
            (
                CreateJson = "application/json",
                example = json!({
                    "frame": example_frames::first(),
                    "box": {"x": 10, "y": 20, "width": 30, "height": 40},
                    "seed": 7
                })
            ),
            (BinaryBody = "application/vnd.bagtrack.snapshot"),
        )
    ),
    responses(
        (
            status = 201, description = "The session is open", body = CreatedSession,
            headers(
                ("Location" = String, description = "The session's path"),
                ("Replayed" = bool, description = "`true` where this answer was given before")
            )
        )
    )
)]
pub async fn create(
    State(state): State<AppState>,
    request: CreateRequest,
) -> Result<Response, Problem> {
    let is_verbose = request.is_verbose();
    let opened = state.service.open(request.into_act()?).await?;
    Ok(created(&opened, is_verbose))
}

/// Open a session under an id of your own
///
/// Takes what `POST /sessions` takes. Make a random UUID, a new one for each session. The same request gets the same
/// answer as long as the session lives, so it can be sent again; another request for the same id answers
/// `session-exists`. Every request for the session has the id in its path, this one too, so a load balancer can route
/// by a hash of the path.
#[utoipa::path(
    put, path = "/sessions/{id}", tag = "sessions", operation_id = "putSession",
    params(("id" = Uuid, Path, description = "The id that the session gets: a UUID"), CreateSettings),
)]
pub async fn put(state: State<AppState>, request: CreateRequest) -> Result<Response, Problem> {
    create(state, request).await
}

/// A request to open a session, with its place in the queue.
#[derive(Debug)]
pub struct CreateRequest {
    pub caller: Caller,
    /// The id or the idempotency key that the client gave the new session.
    pub key: Option<CreationKey>,
    pub account: Arc<Account>,
    pub queue: QueuePermit,
    pub upload: Upload<CreateSettings>,
}

impl FromRequest<AppState> for CreateRequest {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &AppState) -> Result<Self, Problem> {
        let texts = Texts::of_query::<CreateSettings>(request.uri())?;
        let (mut parts, body) = request.into_parts();
        let caller = Caller::from_request_parts(&mut parts, state).await?;
        caller.require_key()?;
        let header = idempotency_key(&parts.headers)?;
        let key = match (id_of_path(&mut parts).await?, header) {
            (Some(_), Some(_)) => {
                let detail = "The id in the path stands for the `Idempotency-Key`; leave that out.";
                return Err(Problem::malformed(detail));
            }
            (Some(id), None) => Some(CreationKey::Id(id)),
            (None, Some(key)) => {
                let key = scoped(key, state, &client_of(&parts));
                Some(CreationKey::Key(caller.owner().clone(), key))
            }
            (None, None) => None,
        };
        let account = state.clients.account(&client_of(&parts));
        // A repeated request may have its answer already, and then needs no room.
        if key.is_none() {
            let quota = ClientSessions(account.clone());
            state.service.check_room(&quota)?;
        }
        let (upload, queue) = Upload::read(state, texts, parts, body).await?;
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
    /// Whether the answer names the tracker's parameters.
    pub fn is_verbose(&self) -> bool {
        self.upload.settings.verbose.0
    }

    /// The act that is asked for.
    ///
    /// # Errors
    /// There is no box, a parameter is unknown, or settings stand beside a snapshot.
    pub fn into_act(self) -> Result<OpenRequest, Problem> {
        let digest = self.digest();
        let (upload, mut files) = (self.upload.settings, self.upload.files);
        let file = files.swap_remove(0);
        let start = if self.upload.is_snapshot || is_snapshot(&file) {
            let allowed = CreateSettings {
                verbose: upload.verbose,
                ..CreateSettings::default()
            };
            if upload != allowed {
                let detail = "A snapshot holds the box and the parameters; leave out all settings.";
                return Err(Problem::malformed(detail));
            }
            Start::Snapshot(file)
        } else {
            Start::Frame {
                file,
                boxes: overrides::boxes(upload.r#box, upload.boxes)?,
                params: Box::new(overrides::params(
                    upload.preset,
                    upload.seed,
                    upload.params,
                )?),
            }
        };
        Ok(OpenRequest {
            key: self.key,
            owner: self.caller.owner().clone(),
            digest,
            start,
            quota: Arc::new(ClientSessions(self.account)),
            queue: self.queue,
        })
    }

    /// A digest of the frame and the settings, the same whichever form they came in. Replicas compare their digests, so
    /// that any change of the digested JSON needs another [`DIGEST_FORMAT`].
    fn digest(&self) -> [u8; 32] {
        let CreateSettings {
            r#box,
            boxes,
            preset,
            seed,
            params,
            // A repeated request may ask for a longer or shorter answer.
            verbose: _,
        } = &self.upload.settings;
        let frame = blake3::hash(&self.upload.files[0]).to_hex();
        let seed = seed.map(|seed| seed.0);
        let is_snapshot = self.upload.is_snapshot;
        let canonical = json!([
            DIGEST_FORMAT,
            frame.as_str(),
            r#box,
            boxes,
            preset,
            seed,
            params,
            is_snapshot
        ]);
        *blake3::hash(canonical.to_string().as_bytes()).as_bytes()
    }
}

/// An idempotency key as it is kept. Each owner has keys of its own. Without API keys all clients are one owner, so the
/// client's address is put before the key.
fn scoped(key: String, state: &AppState, client: &Client) -> String {
    match client {
        Client::Address(address) if !state.access.is_needed() => format!("{address} {key}"),
        _ => key,
    }
}

/// The id that the client made, where the path has one.
async fn id_of_path(parts: &mut Parts) -> Result<Option<Uuid>, Problem> {
    match Option::<Path<String>>::from_request_parts(parts, &()).await {
        Ok(None) => Ok(None),
        Ok(Some(Path(id))) if id.parse::<Uuid>().is_ok() => Ok(id.parse().ok()),
        _ => Err(Problem::malformed(
            "The id in the path must be a UUID, like 67e55044-10b1-426f-9247-bb680e5fe0c8.",
        )),
    }
}
