//! A connection's bytes, with two rules for clients that hyper lacks.
//!
//! - *A client that takes an answer slowly*, or nothing of it, is disconnected.
//! - *A client that has closed its side* may still wait for its answer, or have gone: TCP does not tell. It gets some
//!   time for the answer to a whole request; then it counts as gone, and its request is dropped. Whether the request is
//!   whole shows once its handler has read the body, for which the handler gets half a second.

use super::activity::Activity;
use super::handshake::Transport;
use super::least_rate::LeastRate;
use bagtrack_sessions::clock::{self, Instant, Sleep, sleep_until};
use std::io::{self, IoSlice};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

/// Time for a handler to read the body that has arrived.
const READING: Duration = Duration::from_millis(500);

/// How long the client of a connection is waited for.
#[derive(Debug, Clone, Copy)]
pub struct ClientLimits {
    /// How long the client may take no byte of an answer, or take them too slowly.
    pub write_timeout: Duration,
    /// Bytes a second of an answer that the client has to take at least.
    pub min_answer_rate: u32,
    /// Time for the answer to a client that has closed its side.
    pub half_close_timeout: Duration,
}

/// The stream of a connection.
#[derive(Debug)]
pub struct ConnectionIo {
    stream: Transport,
    activity: Arc<Activity>,
    /// The least rate at which the client has to take answers.
    rate: LeastRate,
    half_close_timeout: Duration,
    /// Set once the client has closed its side: the moment, and the timer that wakes the connection.
    half_closed: Option<(Instant, Pin<Box<Sleep>>)>,
}

impl ConnectionIo {
    /// A connection over `stream`, whose service notes in `activity` what it does.
    pub fn new(stream: Transport, activity: Arc<Activity>, limits: ClientLimits) -> Self {
        Self {
            stream,
            activity,
            rate: LeastRate::new(limits.write_timeout, limits.min_answer_rate),
            half_close_timeout: limits.half_close_timeout,
            half_closed: None,
        }
    }

    /// Passes the result of a write on, or an error where the client is too slow.
    fn paced(
        &mut self,
        cx: &mut Context<'_>,
        written: Poll<io::Result<usize>>,
    ) -> Poll<io::Result<usize>> {
        match &written {
            Poll::Ready(Ok(bytes)) => self.rate.moved(*bytes),
            Poll::Ready(Err(_)) => {}
            Poll::Pending => {
                ready!(self.rate.poll_late(cx));
                return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
            }
        }
        written
    }

    /// Passes the result of a flush or shutdown on, or an error where the client is too slow.
    fn timely(&mut self, cx: &mut Context<'_>, sent: Poll<io::Result<()>>) -> Poll<io::Result<()>> {
        match sent {
            Poll::Ready(_) => self.rate.pause(),
            Poll::Pending => {
                ready!(self.rate.poll_late(cx));
                return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
            }
        }
        sent
    }
}

impl AsyncRead for ConnectionIo {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        ready!(Pin::new(&mut self.stream).poll_read(cx, buffer))?;
        let is_closed = buffer.filled().len() == before && buffer.remaining() > 0;
        let waits = self.activity.idle_since().is_none() && !self.activity.is_stream();
        if is_closed && waits {
            let patience = match self.activity.is_answering() {
                true => self.half_close_timeout,
                false => self.half_close_timeout.min(READING),
            };
            let (since, gone) = self.half_closed.get_or_insert_with(|| {
                let now = clock::now();
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
        let written = Pin::new(&mut self.stream).poll_write(cx, bytes);
        self.paced(cx, written)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        slices: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write_vectored(cx, slices);
        self.paced(cx, written)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let flushed = Pin::new(&mut self.stream).poll_flush(cx);
        self.timely(cx, flushed)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let ended = Pin::new(&mut self.stream).poll_shutdown(cx);
        self.timely(cx, ended)
    }
}
