//! Gives up on a body that comes more slowly than it may.
//!
//! A body has a least rate: a client that sends a byte now and then would hold its connection and its session's place
//! until the deadline of the body. That comes later the more has arrived, so that a video may take its time.

use crate::http::extract::body::TooSlow;
use axum::body::{Body, Bytes, HttpBody};
use axum::extract::Request;
use bagtrack_config::{BODY_BYTES_PER_SECOND, Config};
use bagtrack_net::LeastRate;
use std::pin::Pin;
use std::task::{Context, Poll};

pub fn pace_body(config: &Config, request: Request) -> Request {
    request.map(|body| match body.is_end_stream() {
        true => body,
        false => Body::new(Paced::new(body, config)),
    })
}

struct Paced {
    body: Body,
    rate: LeastRate,
    deadline: LeastRate,
}

impl Paced {
    fn new(body: Body, config: &Config) -> Self {
        let rate = LeastRate::new(config.limits.body_grace, config.limits.min_body_rate);
        Self {
            body,
            // What comes early may be followed by a pause.
            rate: rate.with_credit(config.body_timeout),
            deadline: LeastRate::new(config.body_timeout, BODY_BYTES_PER_SECOND),
        }
    }
}

impl HttpBody for Paced {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<http_body::Frame<Bytes>, axum::Error>>> {
        let Self {
            body,
            rate,
            deadline,
        } = &mut *self;
        let polled = Pin::new(body).poll_frame(cx);
        if let Poll::Ready(Some(Ok(frame))) = &polled {
            let bytes = frame.data_ref().map_or(0, Bytes::len);
            rate.moved(bytes);
            deadline.moved(bytes);
        }
        if polled.is_pending() {
            let is_slow = rate.poll_late(cx).is_ready();
            if deadline.poll_late(cx).is_ready() || is_slow {
                return Poll::Ready(Some(Err(axum::Error::new(TooSlow))));
            }
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
