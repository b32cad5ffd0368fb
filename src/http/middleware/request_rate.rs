//! Bounds how often a client asks for what takes no turn at the workers: pages, states, what is refused.
//!
//! Most of it is done on the network threads, so a client that asks as fast as it can takes them from the others. The
//! other requests by GET count with it, though the metrics are rendered beside these threads, and a worker makes
//! snapshots and pictures of the bag. The client is known by its address, since pages and refusals need no key. A
//! trusted proxy that asks for itself is not counted.

use super::client_identity::{REFUSAL_DELAY, client_at};
use crate::http::problems::problem::Problem;
use crate::http::respond::answer::REPLAYED;
use crate::http::state::AppState;
use axum::extract::{MatchedPath, Request};
use axum::http::Method;
use axum::response::{IntoResponse, Response};
use bagtrack_sessions::clock::sleep;

/// When a request counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Counts {
    /// Before it is answered, and it may be refused.
    Always,
    /// It is answered all the same, if late: whoever asks whether the service lives must not take it for dead, for the
    /// haste of another client at its address.
    AsProbe,
    /// Where it was refused, or answered as before: otherwise it took its turn at the workers.
    WithoutWork,
}

impl Counts {
    fn of(request: &Request) -> Self {
        let route = request.extensions().get::<MatchedPath>();
        let route = route.map_or("", MatchedPath::as_str);
        let sends_frames = matches!(*request.method(), Method::POST | Method::PUT);
        if route.ends_with("/healthz") || route.ends_with("/readyz") {
            Self::AsProbe
        } else if sends_frames && !route.ends_with("/token") {
            Self::WithoutWork
        } else {
            Self::Always
        }
    }
}

/// The middleware. It has to see the matched route, and the address that was noted.
pub async fn bound_rate(
    state: &AppState,
    request: Request,
    next: impl AsyncFnOnce(Request) -> Response,
) -> Response {
    let Some(client) = client_at(&request) else {
        return next(request).await;
    };
    let count = || state.clients.account(&client).count_asked();
    let counts = Counts::of(&request);
    if counts == Counts::Always
        && let Err(exceeded) = count()
    {
        // Whoever does not wait before it asks again is answered no faster.
        sleep(REFUSAL_DELAY).await;
        return Problem::from(exceeded).into_response();
    }
    let response = next(request).await;
    let counts_now = match counts {
        Counts::Always => false,
        Counts::AsProbe => true,
        Counts::WithoutWork => {
            response.status().is_client_error() || response.headers().contains_key(REPLAYED)
        }
    };
    if counts_now && count().is_err() {
        sleep(REFUSAL_DELAY).await;
    }
    response
}
