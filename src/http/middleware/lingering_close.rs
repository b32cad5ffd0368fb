//! Reads the rest of a body that a handler refused, and throws it away.
//!
//! If a server answers and closes while the client still sends, the client's system reports a broken connection, and
//! the problem document is lost. So when an error is answered before the body was read, the rest is read beside the
//! answer, within bounds: at most as many bytes as a body may have, at [its pace](super::body_pace). A client that
//! waits for `100 Continue` has sent nothing, and nothing is read from it.

use crate::http::state::AppState;
use axum::body::{Body, Bytes, HttpBody};
use axum::extract::Request;
use axum::http::header::EXPECT;
use axum::response::Response;
use http_body_util::{BodyExt, Limited};
use std::pin::Pin;
use std::task::{Context, Poll};
use tokio::sync::oneshot;

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

/// A body that sends its rest back when it is dropped.
struct Returning {
    body: Option<Body>,
    polled: bool,
    give_back: Option<oneshot::Sender<(Body, bool)>>,
}

impl Drop for Returning {
    fn drop(&mut self) {
        if let (Some(body), Some(give_back)) = (self.body.take(), self.give_back.take()) {
            // It cannot be sent when the request itself was dropped.
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
