//! Multipart uploads: `frame` parts are files, and `snapshot` is one where a route takes it; all others are settings.
//!
//! The parser looks through all that it has for the next part whenever a piece comes. So it gets a piece only when it can
//! do nothing with what it has, and the head of a part is bounded: a body costs time in proportion to its bytes.

use super::body::{self, Buffer};
use super::misnamed;
use super::settings::Settings;
use super::texts::MAX_TEXT_BYTES;
use super::uploaded::Fields;
use crate::http::problems::problem::Problem;
use axum::body::{Body, Bytes, HttpBody};
use axum::extract::multipart::{Field, MultipartError};
use axum::extract::{FromRequest, Multipart, Request};
use bagtrack_sessions::Charge;
use http_body::Frame;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::task::{Context, Poll};

/// Most bytes of a part's head, and of what stands before the first part.
pub(super) const MAX_HEAD_BYTES: usize = 16 << 10;

/// The head of a part does not end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the head of a part has more than {MAX_HEAD_BYTES} bytes")]
pub(super) struct HeadTooLong;

/// How far the parser is.
#[derive(Debug, Default)]
struct Progress {
    /// Bytes that it got since it gave anything out.
    kept: AtomicUsize,
    /// Whether it may go on without a further piece.
    may_go_on: AtomicBool,
}

impl Progress {
    /// The parser has given something out.
    fn made(&self) {
        self.kept.store(0, Ordering::Relaxed);
        self.may_go_on.store(true, Ordering::Relaxed);
    }
}

/// A body that comes in single pieces.
struct Stepwise {
    body: Body,
    progress: Arc<Progress>,
}

impl HttpBody for Stepwise {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        if self.progress.may_go_on.swap(false, Ordering::Relaxed) {
            cx.waker().wake_by_ref();
            return Poll::Pending;
        }
        if self.progress.kept.load(Ordering::Relaxed) > MAX_HEAD_BYTES {
            return Poll::Ready(Some(Err(axum::Error::new(HeadTooLong))));
        }
        let polled = Pin::new(&mut self.body).poll_frame(cx);
        if let Poll::Ready(Some(Ok(frame))) = &polled {
            let bytes = frame.data_ref().map_or(0, Bytes::len);
            self.progress.kept.fetch_add(bytes, Ordering::Relaxed);
            self.progress.may_go_on.store(true, Ordering::Relaxed);
        }
        polled
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> http_body::SizeHint {
        self.body.size_hint()
    }
}

/// Adds the parts of a multipart body to `fields`: at most `max_files` files. The router limits all bodies to
/// `max_bytes` bytes. What is kept is charged to `charge`.
pub(super) async fn read<S: Settings>(
    request: Request,
    max_bytes: usize,
    max_files: usize,
    fields: &mut Fields,
    charge: &mut Charge,
) -> Result<(), Problem> {
    let progress = Arc::new(Progress::default());
    let request = request.map(|body| {
        let progress = progress.clone();
        Body::new(Stepwise { body, progress })
    });
    let failed = |error: MultipartError| body::problem(&error, max_bytes);
    let mut multipart = Multipart::from_request(request, &()).await.map_err(|_| {
        Problem::malformed("The content type has no valid `boundary`; let the HTTP client set it.")
    })?;
    while let Some(part) = multipart.next_field().await.map_err(failed)? {
        progress.made();
        let name = part.name().unwrap_or("").to_owned();
        if name == "snapshot" && S::TAKES_SNAPSHOT && fields.snapshot.is_none() {
            fields.snapshot = Some(read_part(part, &progress, max_bytes, max_bytes, charge).await?);
        } else if name != "frame" {
            // One byte more than may be, so that a longer text is refused as such.
            let has_file_name = part.file_name().is_some();
            let text = read_part(part, &progress, max_bytes, MAX_TEXT_BYTES + 1, charge).await?;
            if let Some(problem) = misnamed::part::<S>(&name, has_file_name, &text) {
                return Err(problem);
            }
            fields.texts.add(&name, &String::from_utf8_lossy(&text))?;
        } else if fields.files.len() < max_files {
            let file = read_part(part, &progress, max_bytes, max_bytes, charge).await?;
            fields.files.push(file);
        } else {
            return Err(Problem::too_many_frames(max_files));
        }
    }
    Ok(())
}

/// The bytes of a part; no more than about `enough` are kept.
async fn read_part(
    mut part: Field<'_>,
    progress: &Progress,
    max_bytes: usize,
    enough: usize,
    charge: &mut Charge,
) -> Result<Bytes, Problem> {
    let mut buffer = Buffer::new(enough, charge);
    while let Some(piece) = part
        .chunk()
        .await
        .map_err(|error| body::problem(&error, max_bytes))?
    {
        progress.made();
        if buffer.len() < enough {
            buffer.add(&piece)?;
        }
    }
    progress.made();
    Ok(buffer.finish())
}
