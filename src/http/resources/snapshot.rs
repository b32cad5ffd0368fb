//! `GET /sessions/{id}/snapshot`: a session as bytes, to go on elsewhere.

use super::session_path::SessionPath;
use crate::http::extract::texts::refuse_query;
use crate::http::openapi::request_bodies::BinaryBody;
use crate::http::problems::problem::Problem;
use crate::http::quotas::client::Client;
use crate::http::state::AppState;
use axum::Extension;
use axum::body::{Body, Bytes, HttpBody};
use axum::extract::State;
use axum::http::Uri;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use bagtrack_sessions::ByteCharge;
use http_body_util::Full;
use std::convert::Infallible;
use std::pin::Pin;
use std::task::{Context, Poll};

/// The media type of session snapshots.
pub const MEDIA_TYPE: &str = "application/vnd.bagtrack.snapshot";

/// Take a snapshot
///
/// The bytes hold the whole session. Post them to `/sessions`, here or at another instance of the same version that has
/// the same secret (`BAGTRACK_SNAPSHOT_KEYS`), to go on from there under a new id; this session lives on as long as it
/// would have done.
///
/// `curl -o s.snapshot http://localhost:8080/sessions/$ID/snapshot &&
/// curl --data-binary @s.snapshot http://other:8080/sessions`
#[utoipa::path(
    get, path = "/sessions/{id}/snapshot", tag = "sessions", operation_id = "getSnapshot",
    params(("id" = Uuid, Path, description = "The session's id")),
    responses(
        (
            status = 200, description = "The session as bytes", body = BinaryBody,
            content_type = "application/vnd.bagtrack.snapshot"
        )
    )
)]
pub async fn get(
    State(state): State<AppState>,
    path: SessionPath,
    uri: Uri,
    Extension(client): Extension<Client>,
) -> Result<Response, Problem> {
    refuse_query(&uri)?;
    let session = path.find(&state).await?;
    state.service.admission.check_place()?;
    let client = state.clients.account(&client).request()?;
    let mut charge = ByteCharge::new(&state.uploads, client.bytes());
    let queue = state
        .service
        .admission
        .enter(client.flow(), Box::new(client))?;
    let bytes = state
        .service
        .snapshot(session.read_permit()?, queue)
        .await?;
    // The bytes stay in memory until the client has taken them.
    charge.grow(bytes.len())?;
    Ok(([(CONTENT_TYPE, MEDIA_TYPE)], charged(bytes, charge)).into_response())
}

/// A body with the memory that it is charged to.
pub fn charged(bytes: Vec<u8>, charge: ByteCharge) -> Body {
    Body::new(ChargedBody {
        bytes: Full::from(bytes),
        _charge: charge,
    })
}

/// An answer with the memory that it is charged to.
struct ChargedBody {
    bytes: Full<Bytes>,
    _charge: ByteCharge,
}

impl HttpBody for ChargedBody {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<http_body::Frame<Bytes>, Infallible>>> {
        Pin::new(&mut self.bytes).poll_frame(cx)
    }

    fn is_end_stream(&self) -> bool {
        self.bytes.is_end_stream()
    }

    fn size_hint(&self) -> http_body::SizeHint {
        self.bytes.size_hint()
    }
}
