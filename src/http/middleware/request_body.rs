//! The body of a request: the pace at which it has to come, and what becomes of a body that was refused.
//!
//! A body has a least rate: otherwise a client that sends a byte now and then would hold its connection and its
//! session's place until the deadline of the body. Each byte extends the deadline, so that a video may take its time.
//!
//! If a server answers and closes while the client still sends, the client's system reports a broken connection, and
//! the problem document is lost. So when an error is answered before the body was read, the rest is read beside the
//! answer, within bounds: at most as many bytes as a body may have, at the pace of a body. Nothing is read from a
//! client that waits for `100 Continue`: it has sent nothing.

use crate::http::extract::body::TooSlow;
use crate::http::state::AppState;
use axum::body::{Body, Bytes, HttpBody};
use axum::extract::Request;
use axum::http::header::EXPECT;
use axum::response::Response;
use bagtrack_config::{BODY_BYTES_PER_SECOND, Config};
use bagtrack_net::LeastRate;
use http_body_util::{BodyExt, Limited};
use std::pin::Pin;
use std::task::{Context, Poll};
use tokio::sync::oneshot;

/// Makes the body fail with [`TooSlow`] when it comes more slowly than it may.
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
            // Bytes that come early pay for a pause afterwards.
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

/// Reads the rest of a body that a handler refused, and throws it away.
pub async fn drain_refused(
    state: &AppState,
    request: Request,
    next: impl AsyncFnOnce(Request) -> Response,
) -> Response {
    let expects = request.headers().contains_key(EXPECT);
    let (give_back, returned) = oneshot::channel();
    let request = request.map(|body| {
        Body::new(Returning {
            body: Some(body),
            polled: false,
            give_back: Some(give_back),
        })
    });
    let response = next(request).await;
    let status = response.status();
    if (status.is_client_error() || status.is_server_error())
        && let Ok((body, polled)) = returned.await
        && (polled || !expects)
        && !body.is_end_stream()
    {
        let mut rest = Limited::new(body, state.config.max_body_bytes);
        tokio::spawn(async move { while let Some(Ok(_)) = rest.frame().await {} });
    }
    response
}

/// A body that, when it is dropped, sends what was not read back to [`drain_refused`].
struct Returning {
    body: Option<Body>,
    polled: bool,
    give_back: Option<oneshot::Sender<(Body, bool)>>,
}

impl Drop for Returning {
    fn drop(&mut self) {
        if let (Some(body), Some(give_back)) = (self.body.take(), self.give_back.take()) {
            // Nobody receives the body when the request itself was dropped.
            let _ = give_back.send((body, self.polled));
        }
    }
}

impl HttpBody for Returning {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<http_body::Frame<Bytes>, axum::Error>>> {
        self.polled = true;
        match &mut self.body {
            Some(body) => Pin::new(body).poll_frame(cx),
            None => Poll::Ready(None),
        }
    }

    fn is_end_stream(&self) -> bool {
        self.body.as_ref().is_none_or(HttpBody::is_end_stream)
    }

    fn size_hint(&self) -> http_body::SizeHint {
        self.body
            .as_ref()
            .map(HttpBody::size_hint)
            .unwrap_or_default()
    }
}
