//! The least rate of a body. A client that sends a byte now and then would hold its connection and its session's place
//! until the deadline of the body.

use crate::http::config::limits::LimitsConfig;
use axum::body::{Body, Bytes, HttpBody};
use bagtrack_sessions::ByteCharge;
use http_body::Frame;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;
use tokio::time::{Instant, Sleep, sleep_until};

/// The body came more slowly than it may.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the body is too slow")]
pub(super) struct TooSlow;

/// How slow a body may be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    /// Time before the rate counts.
    pub(super) grace: Duration,
    /// Least bytes a second.
    pub(super) min_rate: u32,
}

impl Pace {
    /// That of the settings.
    pub(super) fn of(limits: &LimitsConfig) -> Self {
        Self {
            grace: limits.body_grace,
            min_rate: limits.min_body_rate,
        }
    }
}

/// A body that fails when it is too slow. Where its reader keeps what arrives, it is charged for that too.
pub(super) struct PacedBody {
    body: Body,
    pace: Pace,
    started: Instant,
    received: u64,
    late: Pin<Box<Sleep>>,
    charge: Option<ByteCharge>,
}

impl PacedBody {
    /// From now on. `charge` pays for what arrives.
    pub(super) fn new(body: Body, pace: Pace, charge: Option<ByteCharge>) -> Self {
        let started = Instant::now();
        Self {
            body,
            pace,
            started,
            received: 0,
            late: Box::pin(sleep_until(started + pace.grace)),
            charge,
        }
    }

    fn count(&mut self, bytes: usize) -> Result<(), axum::Error> {
        if let Some(charge) = &mut self.charge {
            charge.grow(bytes).map_err(axum::Error::new)?;
        }
        self.received += bytes as u64;
        let millis = self.received.saturating_mul(1000) / u64::from(self.pace.min_rate.max(1));
        let due = self.started + self.pace.grace + Duration::from_millis(millis);
        self.late.as_mut().reset(due);
        Ok(())
    }
}

impl HttpBody for PacedBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        let polled = Pin::new(&mut self.body).poll_frame(cx);
        match &polled {
            Poll::Ready(Some(Ok(frame))) => {
                let bytes = frame.data_ref().map_or(0, Bytes::len);
                if let Err(error) = self.count(bytes) {
                    return Poll::Ready(Some(Err(error)));
                }
                polled
            }
            Poll::Ready(_) => polled,
            Poll::Pending => {
                ready!(self.late.as_mut().poll(cx));
                Poll::Ready(Some(Err(axum::Error::new(TooSlow))))
            }
        }
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> http_body::SizeHint {
        self.body.size_hint()
    }
}
