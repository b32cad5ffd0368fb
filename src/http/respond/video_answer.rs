//! The answer to a video, which keeps a place for decoding until its reader has taken it.
//!
//! A reader may keep the service waiting for a bounded time in all. After that its answer is cut off as soon as another
//! video waits for the place. Otherwise a few slow readers could hold all places, and a single one the only place of
//! all who share its key or its address.

use crate::http::state::AppState;
use axum::body::{Body, BodyDataStream, Bytes};
use axum::response::Response;
use bagtrack_quotas::{Client, VideoPlaces};
use bagtrack_sessions::clock::{self, Instant};
use futures_util::future::select_all;
use futures_util::{StreamExt, stream};
use std::io;
use std::time::Duration;
use tokio::sync::mpsc;
use tracing::Instrument;

/// Most time that a reader may keep the service waiting in all, in work timeouts.
const READER_PATIENCE: u32 = 4;

/// Passes an answer on to a reader that may be slow. Its body holds a place for a video of this client.
pub fn to_reader(state: &AppState, client: &Client, answer: Response) -> Response {
    let (head, body) = answer.into_parts();
    let (sender, receiver) = mpsc::channel(1);
    let patience = state.config.work_timeout * READER_PATIENCE;
    let account = state.clients.account(client);
    let places = account.videos().iter().chain([&state.videos]);
    let sent = send(
        body.into_data_stream(),
        sender,
        places.cloned().collect(),
        patience,
    );
    tokio::spawn(sent.in_current_span());
    let parts = stream::unfold(Some(receiver), |receiver| async {
        let mut receiver = receiver?;
        match receiver.recv().await {
            Some(Some(part)) => Some((Ok(part), Some(receiver))),
            Some(None) => None,
            None => Some((Err(io::Error::other("the answer was given up")), None)),
        }
    });
    Response::from_parts(head, Body::from_stream(parts))
}

/// Sends the parts of an answer, each when the one before was taken, and `None` after the last. Without that `None` the
/// receiver knows that the answer was given up.
async fn send(
    mut answer: BodyDataStream,
    sender: mpsc::Sender<Option<Bytes>>,
    places: Vec<VideoPlaces>,
    mut patience: Duration,
) {
    loop {
        let since = clock::now();
        let room = tokio::select! {
            biased;
            room = sender.reserve() => room,
            () = wanted_from(&places, since + patience) => {
                tracing::info!("an answer is taken too slowly, and a video waits for its place");
                return;
            }
        };
        let Ok(room) = room else { return };
        patience = patience.saturating_sub(since.elapsed());
        let part = tokio::select! {
            part = answer.next() => part.transpose(),
            () = sender.closed() => return,
        };
        match part {
            Ok(Some(part)) => room.send(Some(part)),
            Ok(None) => return room.send(None),
            Err(_) => return,
        }
    }
}

/// Ready when it is `from` or later, and a video waits for one of these places.
async fn wanted_from(places: &[VideoPlaces], from: Instant) {
    let wanted = places
        .iter()
        .map(|places| Box::pin(places.wanted_from(from)));
    select_all(wanted).await;
}
