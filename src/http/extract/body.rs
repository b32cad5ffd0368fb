//! Reading a request body, and the problems that its errors become.
//!
//! Memory is charged before it is taken: a body that only announces its length, or sends nothing, holds none. Bytes are
//! copied into one buffer as they arrive, since a chunk of one byte by itself takes many times the memory.

use crate::http::problems::problem::Problem;
use axum::body::{Body, Bytes};
use axum::extract::multipart::MultipartError;
use axum::http::StatusCode;
use bagtrack_sessions::{BudgetFull, Charge};
use futures_util::StreamExt;
use http_body_util::{BodyExt, LengthLimitError, Limited};
use std::error::Error;

/// Bytes of a buffer's first capacity, where the body is not smaller.
const FIRST_BYTES: usize = 64 << 10;

/// Most bytes of the head of a form's part, and of the text before the first part.
pub(super) const MAX_HEAD_BYTES: usize = 16 << 10;

/// The head of a part does not end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the head of a part has more than {MAX_HEAD_BYTES} bytes")]
pub(super) struct HeadTooLong;

/// The body came more slowly than [it may](crate::http::middleware::request_body).
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the body is too slow")]
pub struct TooSlow;

/// The bytes of a body as they arrive, with the charge for their memory.
pub(super) struct Buffer<'a> {
    bytes: Vec<u8>,
    /// Most bytes that are expected: the buffer's capacity does not double beyond.
    max: usize,
    charge: &'a mut Charge,
}

impl<'a> Buffer<'a> {
    /// An empty buffer, for about `max` bytes at most.
    pub(super) fn new(max: usize, charge: &'a mut Charge) -> Self {
        Self {
            bytes: Vec::new(),
            max,
            charge,
        }
    }

    /// Adds a piece. Where the buffer is too small, its capacity doubles.
    ///
    /// # Errors
    /// The memory budget has no room for the piece.
    pub(super) fn add(&mut self, piece: &[u8]) -> Result<(), BudgetFull> {
        let (len, capacity) = (self.bytes.len(), self.bytes.capacity());
        let needed = len + piece.len();
        if needed > capacity {
            let wanted = (2 * capacity).max(FIRST_BYTES).min(self.max).max(needed);
            self.charge.grow(wanted - capacity)?;
            self.bytes.reserve_exact(wanted - len);
        }
        self.bytes.extend_from_slice(piece);
        Ok(())
    }

    /// How many bytes there are.
    pub(super) fn len(&self) -> usize {
        self.bytes.len()
    }

    pub(super) fn finish(self) -> Bytes {
        self.bytes.into()
    }
}

/// A body whose bytes are charged to `charge` as they arrive, for a reader that keeps them.
pub(super) fn charged(body: Body, mut charge: Charge) -> Body {
    Body::from_stream(body.into_data_stream().map(move |piece| {
        let piece = piece?;
        charge.grow(piece.len()).map_err(axum::Error::new)?;
        Ok::<_, axum::Error>(piece)
    }))
}

/// Reads the whole body.
///
/// # Errors
/// The body is too large, too slow or cut short, or there is no memory for it.
pub(super) async fn read(
    body: Body,
    max_bytes: usize,
    charge: &mut Charge,
) -> Result<Bytes, Problem> {
    let announced = http_body::Body::size_hint(&body).upper();
    let announced = announced.and_then(|bytes| usize::try_from(bytes).ok());
    let mut body = Limited::new(body, max_bytes);
    let mut buffer = Buffer::new(announced.unwrap_or(max_bytes).min(max_bytes), charge);
    while let Some(frame) = body.frame().await {
        let frame = frame.map_err(|error| problem(error.as_ref(), max_bytes))?;
        // Trailers mean nothing here.
        if let Ok(piece) = frame.into_data() {
            buffer.add(&piece)?;
        }
    }
    Ok(buffer.finish())
}

/// The problem of an error in reading a body, or in parsing a form as it arrives. The reason is somewhere in the chain
/// of the error's sources.
pub(super) fn problem(error: &(dyn Error + 'static), max_bytes: usize) -> Problem {
    let mut cause = Some(error);
    while let Some(error) = cause {
        if error.is::<LengthLimitError>() {
            return Problem::body_too_large(max_bytes);
        }
        if error.is::<TooSlow>() {
            return Problem::body_timeout();
        }
        if error.is::<HeadTooLong>() {
            return Problem::malformed(format!(
                "A part of the multipart form has a head of more than {MAX_HEAD_BYTES} bytes, or so many stand before the \
                 first part."
            ));
        }
        if let Some(full) = error.downcast_ref::<BudgetFull>() {
            return (*full).into();
        }
        if let Some(error) = error.downcast_ref::<MultipartError>()
            && error.status().is_client_error()
            && error.status() != StatusCode::PAYLOAD_TOO_LARGE
        {
            return Problem::malformed(format!(
                "The multipart form cannot be read: {}.",
                error.body_text()
            ));
        }
        cause = error.source();
    }
    Problem::malformed("The body ended before its announced length; send it again.")
}
