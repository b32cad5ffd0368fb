//! Answers as lines of JSON (NDJSON), each as soon as its frame is tracked.
//!
//! Each frame is tracked by itself: the frames before a refused one count. The refusal of the first frame is the answer
//! to the request; that of a later one is the last line, a problem document. The next frame is tracked when the line
//! before it has been taken, so a slow reader holds no lines in memory.

use super::body::json_line;
use crate::http::extract::instance::Instance;
use crate::http::problems::problem::{Effect, Problem};
use crate::http::state::AppState;
use axum::body::{Body, Bytes};
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use bagtrack_api::media_types::LINES;
use futures_util::{StreamExt, stream};
use serde::Serialize;
use std::convert::Infallible;
use std::future::ready;
use std::sync::Arc;
use tracing::{Instrument, Span};

/// Frames that are tracked one after the other.
pub trait FrameSequence: Send + 'static {
    type Answer: Serialize + Send;

    /// Tracks through the next frame; none after the last.
    fn next(&mut self) -> impl Future<Output = Option<Result<Self::Answer, Problem>>> + Send;
}

/// The response with a line for each frame. When its body is dropped, the frames that are left are not tracked.
///
/// # Errors
/// The problem of the first frame.
pub async fn respond<F: FrameSequence>(
    state: AppState,
    instance: Instance,
    mut frames: F,
) -> Result<Response, Problem> {
    let first = frames.next().await;
    let first = line(&first.ok_or_else(Problem::missing_frame)??)?;
    let span = Span::current();
    let following = stream::unfold(Some(frames), move |frames| {
        let (state, instance) = (state.clone(), instance.clone());
        let following = async move {
            let mut frames = frames?;
            match frames.next().await?.and_then(|answer| line(&answer)) {
                Ok(line) => Some((line, Some(frames))),
                Err(problem) => {
                    let document =
                        instance.report(&state, &problem.with_effect(Effect::LinesCount));
                    Some((line(&document).unwrap_or_default(), None))
                }
            }
        };
        following.instrument(span.clone())
    });
    let lines = stream::once(ready(first)).chain(following);
    let body = Body::from_stream(lines.map(Ok::<_, Infallible>));
    Ok(([(CONTENT_TYPE, LINES)], body).into_response())
}

fn line(value: &impl Serialize) -> Result<Bytes, Problem> {
    let line = json_line(value).map(Bytes::from);
    line.map_err(|error| Problem::internal(Arc::new(error)))
}
