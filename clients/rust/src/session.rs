//! A session: takes frames, and returns boxes.

use crate::error::ClientError;
use crate::remote::Remote;
use crate::upload::Upload;
use bagtrack_api::{Answer, Rect};
use bytes::Bytes;
use uuid::Uuid;

/// Follows targets through frames at a service. Sends one request after the other.
#[derive(Debug)]
pub struct Session(Remote);

impl Session {
    pub(crate) fn new(remote: Remote) -> Self {
        Self(remote)
    }

    /// The session's id at the service, which changes when the client opens the session again.
    pub fn id(&self) -> Uuid {
        self.0.id()
    }

    /// The number of the last answered frame; the first frame is 0.
    pub fn frame(&self) -> u64 {
        self.0.answered()
    }

    /// From a service with a store: the last frame whose state is in the store, as of the last answer.
    pub fn checkpoint(&self) -> Option<u64> {
        self.0.standing().checkpoint
    }

    /// Whether the service was about to end at the last answer. The client then moves the session to another service,
    /// if there is one.
    pub fn is_draining(&self) -> bool {
        self.0.standing().draining
    }

    /// How many frames were sent again after they had been answered, because the service had lost them.
    pub fn resent(&self) -> u64 {
        self.0.resent()
    }

    /// Finds the targets in the next frame: the bytes of a JPEG, PNG or WebP file of the first frame's size.
    ///
    /// # Errors
    /// The service refuses the frame, and the session is unchanged; or it does not answer, and the next call sends the
    /// frame before its own.
    pub async fn track(&mut self, frame: impl Into<Bytes>) -> Result<Answer, ClientError> {
        self.next(vec![frame.into()], None).await
    }

    /// Sends the next frames in one request. If a frame is bad, none is tracked, and the problem has its `index`.
    ///
    /// # Errors
    /// As [`track`](Self::track).
    pub async fn track_many<F: Into<Bytes>>(
        &mut self,
        frames: impl IntoIterator<Item = F>,
    ) -> Result<Vec<Answer>, ClientError> {
        let frames: Vec<Bytes> = frames.into_iter().map(Into::into).collect();
        if frames.is_empty() {
            return Ok(Vec::new());
        }
        let correction = None;
        self.0.advance(Upload { frames, correction }).await
    }

    /// Sends the next frame with the right box of a target in it, in pixels; targets are counted from 0. The image may
    /// be one that was sent before: it counts as a new frame.
    ///
    /// # Errors
    /// As [`track`](Self::track).
    pub async fn correct(
        &mut self,
        frame: impl Into<Bytes>,
        target: usize,
        rect: Rect,
    ) -> Result<Answer, ClientError> {
        self.next(vec![frame.into()], Some((target, rect))).await
    }

    /// A snapshot of the session, for [`Client::restore`](crate::Client::restore).
    ///
    /// # Errors
    /// The service refuses, or gives no answer.
    pub async fn snapshot(&mut self) -> Result<Bytes, ClientError> {
        self.0.snapshot().await
    }

    /// Ends the session. A session that is only dropped expires at the service.
    ///
    /// # Errors
    /// The service refuses, or gives no answer.
    pub async fn end(self) -> Result<(), ClientError> {
        self.0.end().await
    }

    /// Sends a frame.
    async fn next(
        &mut self,
        frames: Vec<Bytes>,
        correction: Option<(usize, Rect)>,
    ) -> Result<Answer, ClientError> {
        let mut answers = self.0.advance(Upload { frames, correction }).await?;
        Ok(answers.swap_remove(0))
    }
}
