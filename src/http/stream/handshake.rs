//! Opens a stream.

use super::frame_work::FrameWork;
use super::session_stream::{SessionStream, Stand};
use super::upgrade::{MessageLimits, Upgrade};
use super::waiting::Waiting;
use crate::http::extract::caller::SessionPath;
use crate::http::extract::caller::{Caller, client_of};
use crate::http::extract::instance::Instance;
use crate::http::extract::query::QuerySettings;
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::extract::{FromRequestParts, State};
use axum::http::request::Parts;
use axum::response::Response;
use bagtrack_api::requests::StreamSettings;
use bagtrack_config::BODY_BYTES_PER_SECOND;
use bagtrack_net::{ConnectionHold, LeastRate, Rates};
use bagtrack_quotas::{Account, Client};
use bagtrack_sessions::{Flow, ReplayError, Session, StreamPlace};
use std::io;
use std::sync::{Arc, Mutex};

/// Most bytes of a frame for each of its pixels: no sensible file has more than the pixels themselves.
const BYTES_PER_PIXEL: usize = 4;
/// Room for the headers of the image file, besides its pixels.
const BESIDE_BYTES: usize = 256 << 10;

/// Send frames over a WebSocket
///
/// A binary message is a frame. A text message before it may give its number or a corrected box: `{"frame": 7}`,
/// `{"box": [12, 22, 30, 40]}`. With `{"see": true}` the answer has the particles (centre, width and weight of the 200
/// likeliest) and the votes of the bag's entries. All answers are text messages. The first is `{"next": N}`, the number
/// of the next frame. Then each frame gets its answer, or a problem document, in order. A problem leaves the session as
/// it was.
///
/// Send further frames without waiting for the answers, at most 32. If the line breaks, open the stream again with
/// `?from=N`, N being the first frame without an answer: the stored answers come again, with `"replayed": true`, and
/// frames go on with the number `next`. With `drop=true` a frame that waits is skipped for a newer one; `"skipped"` in
/// an answer counts the frames before it that were. With a store, `"checkpoint": N` in an answer names the last frame
/// whose state is in it.
///
/// A page sends its session token as a protocol: `new WebSocket(url, ["bagtrack", token])`. The service closes with
/// 4000 and the status of a problem (410: the session has expired), 4409 when a newer stream of the session has taken
/// its place, and 1001 when it ends. A session has one stream at a time.
#[utoipa::path(
    get, path = "/sessions/{id}/stream", tag = "sessions", operation_id = "openStream",
    params(
        ("id" = Uuid, Path, description = "The session's id"),
        StreamSettings,
    ),
    responses((status = 101, description = "The stream is open"))
)]
pub async fn open(
    State(state): State<AppState>,
    request: StreamRequest,
) -> Result<Response, Problem> {
    let (session, settings) = (&request.session, request.settings);
    let account = state.clients.account(&request.client);
    let permit = account.stream()?;
    let (place, stand) = begin(&state, session, account.flow(), settings.from).await?;
    let limits = message_limits(&state, session, &account);
    let stream = SessionStream {
        connection: request.connection,
        permit,
        stand,
        instance: request.instance,
        work: Arc::new(FrameWork {
            caller: request.caller,
            account,
            session: session.id(),
            place,
            waiting: Mutex::new(Waiting::new(settings.drop.0)),
            state,
        }),
    };
    Ok(request.upgrade.answer(limits, |socket| stream.run(socket)))
}

pub struct StreamRequest {
    instance: Instance,
    settings: StreamSettings,
    session: Arc<Session>,
    upgrade: Upgrade,
    /// The connection that the stream takes over.
    connection: ConnectionHold,
    caller: Caller,
    client: Client,
}

impl FromRequestParts<AppState> for StreamRequest {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, Problem> {
        let Ok(instance) = Instance::from_request_parts(parts, state).await;
        let QuerySettings(settings) = QuerySettings::from_request_parts(parts, state).await?;
        let path = SessionPath::from_request_parts(parts, state).await?;
        let session = path.find(state).await?;
        let upgrade = Upgrade::of(parts).await?;
        let connection = parts.extensions.get::<ConnectionHold>().cloned();
        let connection = connection.ok_or_else(|| {
            let error = io::Error::other("the service does not know the connection of a request");
            Problem::internal(Arc::new(error))
        })?;
        Ok(Self {
            instance,
            settings,
            session,
            upgrade,
            connection,
            caller: Caller::from_request_parts(parts, state).await?,
            client: client_of(parts),
        })
    }
}

/// How large messages may be, how slowly they may come, and what their memory is charged to.
fn message_limits(state: &AppState, session: &Session, account: &Account) -> MessageLimits {
    let config = &state.config;
    MessageLimits {
        max_bytes: max_message_bytes(state, session),
        budgets: [state.uploads.clone(), account.bytes().clone()],
        rates: Rates {
            bytes: LeastRate::new(config.body_timeout, config.limits.min_body_rate),
            message: LeastRate::new(config.body_timeout, BODY_BYTES_PER_SECOND),
            messages: account.messages(),
        },
    }
}

/// Most bytes of a message, which has one frame.
fn max_message_bytes(state: &AppState, session: &Session) -> usize {
    let (width, height) = session.source_size();
    let pixels = usize::try_from(u64::from(width) * u64::from(height)).unwrap_or(usize::MAX);
    let usual = pixels
        .saturating_mul(BYTES_PER_PIXEL)
        .saturating_add(BESIDE_BYTES);
    usual.min(state.config.max_frame_bytes)
}

/// Finds where the session stands, and takes the session's place for a stream. Waits for the frame at work. An older
/// stream, here or at another replica, tracks no further frame; a stream that cannot begin leaves the older one alone.
async fn begin(
    state: &AppState,
    session: &Arc<Session>,
    flow: Flow,
    from: Option<u64>,
) -> Result<(Arc<StreamPlace>, Stand), Problem> {
    let fenced = state.service.fence(session.read_permit()?, flow);
    let mut locked = fenced.await?;
    let next = locked.state().latest_frame() + 1;
    let from = from.unwrap_or(next);
    let stored = locked.state().answers_from(from);
    let stored = stored.ok_or(ReplayError::OutOfOrder {
        got: from,
        expected: next,
    })?;
    let place = Arc::new(state.service.streams.take(session.id()));
    place.begin(session);
    let stand = Stand {
        next,
        stored,
        checkpoint: session.checkpoint(),
    };
    Ok((place, stand))
}
