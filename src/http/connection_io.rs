//! A connection's bytes, with what hyper's own handling of them lacks.
//!
//! - *A client that takes nothing* of an answer is let go after a time.
//! - *A client that has closed its side* may still wait for its answer, or have gone: TCP does not tell. It gets some
//!   time for the answer to a whole request; then it counts as gone, and its request is dropped. Whether the request is
//!   whole shows when its handler has read the body, for which there is a moment.
//! - *hyper's own answers* to heads that it cannot read get a problem document.

use super::activity::Activity;
use super::head_problems;
use std::io::{self, IoSlice};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Instant, Sleep, sleep_until};
use tokio_io_timeout::TimeoutStream;

/// Time for a handler to read the body that has come.
const READING: Duration = Duration::from_millis(500);

/// The stream of a connection.
pub struct ConnectionIo {
    stream: Pin<Box<TimeoutStream<TcpStream>>>,
    activity: Arc<Activity>,
    half_close_timeout: Duration,
    /// Set when the client has closed its side: since when, and what wakes the connection.
    half_closed: Option<(Instant, Pin<Box<Sleep>>)>,
    /// What is written in place of an answer of hyper's own, and how much of it is written.
    document: Vec<u8>,
    written: usize,
}

impl ConnectionIo {
    /// For a stream whose service tells `activity` what it does.
    pub fn new(
        stream: TcpStream,
        activity: Arc<Activity>,
        write_timeout: Duration,
        half_close_timeout: Duration,
    ) -> Self {
        let mut stream = TimeoutStream::new(stream);
        stream.set_write_timeout(Some(write_timeout));
        Self {
            stream: Box::pin(stream),
            activity,
            half_close_timeout,
            half_closed: None,
            document: Vec::new(),
            written: 0,
        }
    }

    /// Whether `bytes` are an answer of hyper's own. Then its document is to be written.
    fn takes_over(&mut self, bytes: &[u8]) -> bool {
        if self.activity.idle_since().is_none() {
            return false;
        }
        match head_problems::document_for(bytes) {
            Some(document) => {
                self.document = document;
                self.written = 0;
                true
            }
            None => false,
        }
    }

    fn poll_document(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        while self.written < self.document.len() {
            let rest = &self.document[self.written..];
            let written = ready!(self.stream.as_mut().poll_write(cx, rest))?;
            if written == 0 {
                return Poll::Ready(Err(io::ErrorKind::WriteZero.into()));
            }
            self.written += written;
        }
        Poll::Ready(Ok(()))
    }
}

impl AsyncRead for ConnectionIo {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        ready!(self.stream.as_mut().poll_read(cx, buffer))?;
        let is_closed = buffer.filled().len() == before && buffer.remaining() > 0;
        let waits = self.activity.idle_since().is_none() && !self.activity.is_stream();
        if is_closed && waits {
            let patience = match self.activity.is_answering() {
                true => self.half_close_timeout,
                false => self.half_close_timeout.min(READING),
            };
            let (since, gone) = self.half_closed.get_or_insert_with(|| {
                let now = Instant::now();
                (now, Box::pin(sleep_until(now)))
            });
            if gone.deadline() != *since + patience {
                gone.as_mut().reset(*since + patience);
            }
            ready!(gone.as_mut().poll(cx));
        }
        Poll::Ready(Ok(()))
    }
}

impl AsyncWrite for ConnectionIo {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        ready!(self.poll_document(cx))?;
        if self.takes_over(bytes) {
            return Poll::Ready(Ok(bytes.len()));
        }
        self.stream.as_mut().poll_write(cx, bytes)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        slices: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        ready!(self.poll_document(cx))?;
        if let [bytes] = slices
            && self.takes_over(bytes)
        {
            return Poll::Ready(Ok(bytes.len()));
        }
        self.stream.as_mut().poll_write_vectored(cx, slices)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        ready!(self.poll_document(cx))?;
        self.stream.as_mut().poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        ready!(self.poll_document(cx))?;
        self.stream.as_mut().poll_shutdown(cx)
    }
}
