//! Requests that are let in, with their permits and what they upload: frames for a live session, files for no session,
//! and a look at a session's state.

use super::answer_form::AnswerForm;
use super::body::{self, charged};
use super::caller::{Caller, SessionPath, client_of};
use super::instance::Instance;
use super::texts::{Fields, Texts};
use super::{json, multipart};
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::body::{Body, Bytes};
use axum::extract::{FromRequest, FromRequestParts, Request};
use axum::http::header::{CONTENT_LENGTH, CONTENT_TYPE};
use axum::http::request::Parts;
use bagtrack_api::ProblemKind as Kind;
use bagtrack_api::media_types::SNAPSHOT;
use bagtrack_api::requests::{FrameCount, Settings};
use bagtrack_ingest::video::{VideoFormat, video_format};
use bagtrack_quotas::{Client, RequestPermit};
use bagtrack_sessions::{Charge, ChargedBytes, QueuePermit, SessionPermit, WorkMeter};
use std::sync::Arc;

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

/// A request with files and settings and no session. A session token is not enough.
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
    /// The settings of the query, checked before the session is looked for.
    pub query: Q,
    pub permit: SessionPermit,
    pub queue: QueuePermit,
    /// The charge for the memory of the answer; 0 bytes so far.
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

/// The content type that `curl -d` gives any body.
const FORM_URLENCODED: &str = "application/x-www-form-urlencoded";
/// Least bytes of a body for which the answer may be [`STRIPPED`]: shorter files may have no line breaks and zeros.
const MIN_STRIPPED: usize = 256;

const STRIPPED: &str =
    "The file has lost its line breaks and zeros, as `curl -d` does: use `--data-binary @file`.";

const VIDEO: &str = "A video goes to `POST /track` with a box, or to `POST /sessions/{id}/frames` after a picture has \
    opened the session, one in a request. Here send a JPEG, PNG or WebP image.";

/// What a client uploaded.
#[derive(Debug)]
pub struct Upload<S> {
    /// The files as sent, in order; at least one, none of them empty.
    pub files: Vec<Bytes>,
    /// The settings, from the query and the body.
    pub settings: S,
    /// The snapshot beside the files.
    pub snapshot: Option<Bytes>,
    /// The format of the only file, where it is a video.
    pub video: Option<VideoFormat>,
    /// Whether the content type says that the file is a session snapshot.
    pub is_snapshot: bool,
}

impl<S: Settings> Upload<S> {
    /// Lets a request in, reads its body, then takes a place in the queue. The settings of the query, `texts`, count
    /// where the body does not have them. JSON is parsed on a worker. The place holds the request's permit until its
    /// work has ended, and the files hold the charge for their memory.
    ///
    /// # Errors
    /// The request is not let in, the body cannot be read, the request has too few or too many frames, a setting is
    /// wrong, the queue is full, or the client has sent too many frames lately.
    pub async fn read(
        state: &AppState,
        texts: Texts,
        parts: Parts,
        body: Body,
    ) -> Result<(Self, QueuePermit), Problem> {
        let permit = admit(state, &parts)?;
        let request = Request::from_parts(parts, body);
        let max_files = match S::FRAMES {
            FrameCount::One => 1,
            FrameCount::Several => state.config.max_frames,
        };
        let media_type = media_type(&request);
        let body = Arrived::read::<S>(state, &permit, request, &media_type, max_files);
        let Arrived {
            mut fields,
            json,
            charge,
        } = body.await?;
        let (flow, permit) = (permit.flow(), Arc::new(permit));
        let held = Box::new(permit.clone());
        let queue = state.service.admission.enter(flow, held)?;
        let charge = Arc::new(charge);
        let own = |bytes| Bytes::from(ChargedBytes::sharing(bytes, &charge));
        if let Some(bytes) = json.map(own) {
            let parser = queue.clone().for_time(json::least_time(bytes.len()));
            let parse = move |_: &mut WorkMeter| {
                json::read::<S>(&bytes, max_files, &mut fields)?;
                Ok(fields)
            };
            fields = state.service.run::<_, Problem, _>(parser, parse).await?;
        }
        let Fields {
            files,
            snapshot,
            media_type: of_file,
            texts: of_body,
        } = fields;
        check_files::<S>(&files, max_files)?;
        let of_file = of_file.as_deref().unwrap_or(&media_type);
        let formats = files.iter().map(|file| video_format(file, of_file));
        let video = formats.flatten().next();
        if video.is_some() && (!S::TAKES_VIDEO || files.len() > 1) {
            return Err(Problem::new(Kind::UnsupportedImage, VIDEO));
        }
        let upload = Self {
            settings: of_body.or(texts).parse()?,
            is_snapshot: media_type == SNAPSHOT,
            snapshot: snapshot.map(own),
            video,
            files: files.into_iter().map(own).collect(),
        };
        if upload.video.is_none() {
            permit.count_frames(upload.files.len())?;
        }
        // Overload may refuse a waiting request with one frame. Several are too much to send again: they wait.
        let queue = match upload.video.is_some() || upload.files.len() > 1 {
            true => queue.waiting(),
            false => queue,
        };
        Ok((upload, queue))
    }
}

struct Arrived {
    fields: Fields,
    /// The text of a JSON body, not parsed yet.
    json: Option<Bytes>,
    charge: Charge,
}

impl Arrived {
    async fn read<S: Settings>(
        state: &AppState,
        permit: &RequestPermit,
        request: Request,
        media_type: &str,
        max_files: usize,
    ) -> Result<Self, Problem> {
        let new_charge = || Charge::new(&state.uploads, permit.bytes());
        let (mut charge, mut fields, mut json) = (new_charge(), Fields::default(), None);
        let max_bytes = state.config.max_body_bytes;
        if media_type == "multipart/form-data" {
            // The parser keeps bytes that it has not given out yet; they are charged beside the files.
            let arriving = new_charge();
            let request = request.map(|body| charged(body, arriving));
            multipart::read::<S>(request, max_bytes, max_files, &mut fields, &mut charge).await?;
        } else {
            let body = request.into_body();
            let bytes = body::read(body, max_bytes, &mut charge).await?;
            // Content types are often wrong: those of `curl -d`, and of generated clients that send a file.
            let is_labelled = media_type == "application/json";
            if let Some(text) = json::text_of(&bytes, is_labelled) {
                charge.grow(json::DECODED_PER_BYTE * text.len())?;
                json = Some(bytes.slice_ref(text));
            } else if media_type == FORM_URLENCODED && is_stripped(&bytes) {
                return Err(Problem::new(Kind::FrameDamaged, STRIPPED));
            } else if !bytes.is_empty() {
                fields.files.push(bytes);
            }
        }
        Ok(Self {
            fields,
            json,
            charge,
        })
    }
}

/// Lets in a request before any of its body is read: takes a place among the client's requests in flight.
///
/// # Errors
/// The announced body is too large, the queue is full, or the client has too many requests in flight.
fn admit(state: &AppState, parts: &Parts) -> Result<RequestPermit, Problem> {
    let max = state.config.max_body_bytes;
    let length = parts.headers.get(CONTENT_LENGTH);
    let length = length.and_then(|length| length.to_str().ok()?.parse::<u64>().ok());
    if length.is_some_and(|length| length > max as u64) {
        return Err(Problem::body_too_large(max));
    }
    let account = state.clients.account(&client_of(parts));
    state.service.admission.check_place(account.flow())?;
    Ok(account.request()?)
}

/// Whether bytes look like an image from which `curl -d` has taken all line breaks and zeros. A whole image of this
/// length has some of them, and bytes that are all ASCII are a text.
fn is_stripped(bytes: &[u8]) -> bool {
    let is_lost = |byte: &u8| matches!(byte, 0 | b'\n' | b'\r');
    bytes.len() >= MIN_STRIPPED && !bytes.is_ascii() && !bytes.iter().any(is_lost)
}

fn check_files<S: Settings>(files: &[Bytes], max_files: usize) -> Result<(), Problem> {
    if files.len() > max_files {
        return Err(Problem::too_many_frames::<S>(max_files));
    }
    if files.is_empty() {
        return Err(Problem::missing_frame());
    }
    match files.iter().position(Bytes::is_empty) {
        Some(empty) => Err(Problem::missing_frame().of_frame(empty, files.len())),
        None => Ok(()),
    }
}

fn media_type(request: &Request) -> String {
    let value = request.headers().get(CONTENT_TYPE);
    let text = value.and_then(|value| value.to_str().ok()).unwrap_or("");
    let essence = text.split(';').next().unwrap_or("");
    essence.trim().to_ascii_lowercase()
}
