//! The least rate of a body. A client that sends a byte now and then would hold its connection and its session's place
//! until the deadline of the body.

use axum::body::{Body, Bytes};
use bagtrack_config::Config;
use bagtrack_net::LeastRate;
use bagtrack_sessions::Charge;
use futures_util::{StreamExt, stream};
use std::task::{Poll, ready};

/// The body came more slowly than it may.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the body is too slow")]
pub(super) struct TooSlow;

/// A body that fails when it is slower than these settings say. Where its reader keeps what arrives, `charge` pays for
/// that.
pub(super) fn paced(body: Body, config: &Config, mut charge: Option<Charge>) -> Body {
    let limits = &config.limits;
    let rate = LeastRate::new(limits.body_grace, limits.min_body_rate);
    // What comes early may be followed by a pause.
    let mut rate = rate.with_credit(config.body_timeout);
    let mut pieces = body.into_data_stream();
    let mut pay = move |piece: &Bytes| match &mut charge {
        Some(charge) => charge.grow(piece.len()).map_err(axum::Error::new),
        None => Ok(()),
    };
    Body::from_stream(stream::poll_fn(move |cx| {
        match pieces.poll_next_unpin(cx) {
            Poll::Ready(Some(Ok(piece))) => {
                rate.moved(piece.len());
                Poll::Ready(Some(pay(&piece).map(|()| piece)))
            }
            Poll::Ready(other) => Poll::Ready(other),
            Poll::Pending => {
                ready!(rate.poll_late(cx));
                Poll::Ready(Some(Err(axum::Error::new(TooSlow))))
            }
        }
    }))
}
