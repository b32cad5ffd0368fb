//! `POST /track` with a video and a box: a line of JSON for each frame, the first one being the box. Nothing is kept.
//!
//! The next frame is tracked when the line before it has been taken. A problem after the first line is the last line.

use crate::http::problems::document::ProblemDocument;
use crate::http::problems::problem::Problem;
use crate::http::quotas::client::Client;
use crate::http::respond::answer::Answer;
use crate::http::respond::{json, response_format};
use crate::http::service::advance::NextFrames;
use crate::http::service::box_check;
use crate::http::service::first_frame::FirstFrame;
use crate::http::service::state::AppState;
use crate::http::service::video_frames::VideoFrames;
use crate::http::service::video_place::{VideoPlace, count_frame};
use crate::http::service::work;
use crate::ingest::video::VideoFormat;
use crate::sessions::{QueuePermit, SessionState, WorkMeter};
use axum::body::{Body, Bytes};
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use futures_util::stream;
use serde::Serialize;
use std::convert::Infallible;
use std::sync::Arc;
use tracing::Instrument;

/// A video and what its first frame is to begin with.
#[derive(Debug)]
pub struct VideoRequest {
    /// The video.
    pub video: Bytes,
    /// How it is stored.
    pub format: VideoFormat,
    /// The boxes and parameters.
    pub first: FirstFrame,
    /// The place in the queue.
    pub queue: QueuePermit,
    /// Who sends it.
    pub client: Client,
    /// The path of the request, for problems.
    pub path: String,
    /// The id of the request, for problems.
    pub request_id: String,
}

/// A video that is tracked.
struct VideoTrack {
    state: AppState,
    queue: QueuePermit,
    client: Client,
    frames: VideoFrames,
    path: String,
    request_id: String,
}

/// The answer to the request.
///
/// # Errors
/// The problem of the first frame.
pub async fn answer(state: AppState, request: VideoRequest) -> Result<Response, Problem> {
    let (client, first) = (request.client, request.first);
    let (place, queue) = VideoPlace::take(&state, &client, request.queue).await?;
    let frames = VideoFrames::decode(&state, request.video, request.format, place)?;
    let mut video = VideoTrack {
        queue: queue.for_frames(first.boxes.as_slice().len()),
        state,
        client,
        frames,
        path: request.path,
        request_id: request.request_id,
    };
    let (line, track) = video.begin(first).await?;
    let lines = stream::unfold(Some((video, Some(line), track)), |work| {
        let following = async move {
            let (mut video, first, track) = work?;
            match first {
                Some(line) => Some((line, Some((video, None, track)))),
                None => match video.next(track).await? {
                    Ok((line, track)) => Some((line, Some((video, None, track)))),
                    Err(problem) => Some((video.last(&problem), None)),
                },
            }
        };
        following.instrument(tracing::Span::current())
    });
    let lines = futures_util::StreamExt::map(lines, Ok::<_, Infallible>);
    let body = Body::from_stream(lines);
    Ok(([(CONTENT_TYPE, response_format::LINES)], body).into_response())
}

impl VideoTrack {
    /// The line of the first frame, and the track that begins there.
    async fn begin(&mut self, first: FirstFrame) -> Result<(Bytes, SessionState), Problem> {
        let file = self
            .frames
            .next()
            .await
            .ok_or_else(Problem::missing_frame)??;
        count_frame(&self.state, &self.client).await?;
        let worker = self.state.clone();
        let begin = move |meter: &mut WorkMeter| {
            let boxes = first.boxes.clone();
            let track = first.begin(&worker, &file, meter)?;
            let warnings = box_check::warnings(boxes.as_slice(), track.source_size());
            Ok((track, warnings))
        };
        let (track, warnings) = work::run(&self.state, self.queue.clone(), begin).await?;
        let answer = Answer::from(&track.latest()).with_warnings(warnings);
        Ok((line(&answer)?, track))
    }

    /// The line of the next frame, and the track up to there; none after the last.
    async fn next(
        &mut self,
        track: SessionState,
    ) -> Option<Result<(Bytes, SessionState), Problem>> {
        let file = match self.frames.next().await? {
            Ok(file) => file,
            Err(problem) => return Some(Err(problem)),
        };
        Some(self.advance(track, file).await)
    }

    async fn advance(
        &self,
        mut track: SessionState,
        file: Bytes,
    ) -> Result<(Bytes, SessionState), Problem> {
        count_frame(&self.state, &self.client).await?;
        let worker = self.state.clone();
        let advance = move |meter: &mut WorkMeter| {
            let next = NextFrames::posted(None, vec![file], None);
            let (limits, metrics) = (worker.config.request_limits(), &worker.metrics.tracking);
            next.advance_state(&mut track, &limits, meter, metrics)?;
            Ok(track)
        };
        let track = work::run(&self.state, self.queue.clone(), advance).await?;
        Ok((line(&Answer::from(&track.latest()))?, track))
    }

    /// A problem as the last line.
    fn last(&self, problem: &Problem) -> Bytes {
        self.state.metrics.problem(problem.kind());
        let (kind, cause) = (problem.kind().slug(), problem.cause());
        let cause = cause.as_deref().unwrap_or("none");
        tracing::info!(kind, cause, "problem of a later frame");
        let (path, id) = (self.path.clone(), self.request_id.clone());
        let base = self.state.config.base_path.as_str();
        line(&ProblemDocument::new(problem, base, path, id)).unwrap_or_default()
    }
}

fn line(value: &impl Serialize) -> Result<Bytes, Problem> {
    let line = json::line(value).map(Bytes::from);
    line.map_err(|error| Problem::internal(Arc::new(error)))
}
