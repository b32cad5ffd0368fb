//! Multipart uploads: `frame` and, where a route takes one, `snapshot` are files; all other parts are settings.
//!
//! Whenever a piece of the body comes, the parser searches all bytes that it has again (docs/upstream/multer.md). So
//! small pieces are gathered, the parser gets them only when it can do nothing with what it has, and the head of a part
//! is bounded: then the time is in proportion to the bytes of the body.

use super::body::{self, Buffer, HeadTooLong, MAX_HEAD_BYTES};
use super::misnamed;
use super::texts::{Fields, MAX_TEXT_BYTES};
use crate::http::problems::problem::Problem;
use axum::body::{Body, Bytes, HttpBody};
use axum::extract::multipart::{Field, MultipartError};
use axum::extract::{FromRequest, Multipart, Request};
use axum::http::header::CONTENT_TYPE;
use bagtrack_api::requests::Settings;
use bagtrack_sessions::Charge;
use bytes::BytesMut;
use http_body::Frame;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::task::{Context, Poll};

/// Most bytes of the content type. A boundary has at most 70 (RFC 2046, section 5.1.1), and bytes that may be the
/// beginning of a boundary are searched again whenever a piece comes.
const MAX_TYPE_BYTES: usize = 256;

/// Pieces of fewer bytes that have arrived are put together.
const ENOUGH_BYTES: usize = 8 << 10;

/// How far the parser is.
#[derive(Debug, Default)]
struct Progress {
    /// Bytes that the parser got since it last gave something out.
    kept: AtomicUsize,
    /// Whether the parser may go on without a further piece.
    may_go_on: AtomicBool,
}

impl Progress {
    /// The parser has given something out.
    fn made(&self) {
        self.kept.store(0, Ordering::Relaxed);
        self.may_go_on.store(true, Ordering::Relaxed);
    }
}

/// A body that gives the parser gathered pieces, and none while the parser can go on without.
struct Stepwise {
    body: Body,
    has_ended: bool,
    progress: Arc<Progress>,
}

impl Stepwise {
    /// The bytes that have come: small pieces together up to [`ENOUGH_BYTES`], or a larger one; `None` at the end.
    fn poll_gathered(&mut self, cx: &mut Context<'_>) -> Poll<Option<Result<Bytes, axum::Error>>> {
        let mut gathered = BytesMut::new();
        while !self.has_ended && gathered.len() < ENOUGH_BYTES {
            match Pin::new(&mut self.body).poll_frame(cx)? {
                // Trailers mean nothing here.
                Poll::Ready(Some(frame)) => match frame.into_data() {
                    Ok(piece) if gathered.is_empty() && piece.len() >= ENOUGH_BYTES => {
                        return Poll::Ready(Some(Ok(piece)));
                    }
                    Ok(piece) => gathered.extend_from_slice(&piece),
                    Err(_) => {}
                },
                Poll::Ready(None) => self.has_ended = true,
                Poll::Pending if gathered.is_empty() => return Poll::Pending,
                Poll::Pending => break,
            }
        }
        Poll::Ready((!gathered.is_empty()).then(|| Ok(gathered.freeze())))
    }
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
        let polled = self.poll_gathered(cx);
        if let Poll::Ready(Some(Ok(bytes))) = &polled {
            self.progress.kept.fetch_add(bytes.len(), Ordering::Relaxed);
            self.progress.may_go_on.store(true, Ordering::Relaxed);
        }
        polled.map_ok(Frame::data)
    }
}

/// Adds the parts of a multipart body to `fields`: at most `max_files` files. The router limits all bodies to
/// `max_bytes` bytes. The bytes that are kept are charged to `charge`.
pub(super) async fn read<S: Settings>(
    request: Request,
    max_bytes: usize,
    max_files: usize,
    fields: &mut Fields,
    charge: &mut Charge,
) -> Result<(), Problem> {
    let media_type = request.headers().get(CONTENT_TYPE);
    if media_type.is_some_and(|media_type| media_type.len() > MAX_TYPE_BYTES) {
        let detail = "The content type is too long. A `boundary` has at most 70 characters.";
        return Err(Problem::malformed(detail));
    }
    let progress = Arc::new(Progress::default());
    let request = request.map(|body| {
        let progress = progress.clone();
        Body::new(Stepwise {
            body,
            has_ended: false,
            progress,
        })
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
            // One byte more than a setting may have, so that a longer text is refused as too long.
            let has_file_name = part.file_name().is_some();
            let text = read_part(part, &progress, max_bytes, MAX_TEXT_BYTES + 1, charge).await?;
            if let Some(problem) = misnamed::part::<S>(&name, has_file_name, &text) {
                return Err(problem);
            }
            fields.texts.add(&name, &String::from_utf8_lossy(&text))?;
        } else if fields.files.len() < max_files {
            // Of several files the type of a video is kept.
            let told = fields.media_type.take();
            let told = told.filter(|kind| kind.starts_with("video/"));
            fields.media_type = told.or(part.content_type().map(str::to_lowercase));
            let file = read_part(part, &progress, max_bytes, max_bytes, charge).await?;
            fields.files.push(file);
        } else {
            return Err(Problem::too_many_frames::<S>(max_files));
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
