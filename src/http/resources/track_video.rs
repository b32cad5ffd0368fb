//! `POST /track` with a video and a box: a line of JSON for each frame, the first one being the box. Nothing is kept.
//!
//! The next frame is tracked when the line before it has been taken. A problem after the first line is the last line.

use crate::http::extract::video_frames::VideoFrames;
use crate::http::extract::video_place::{VideoPlace, count_frame};
use crate::http::problems::document::ProblemDocument;
use crate::http::problems::problem::Problem;
use crate::http::quotas::client::Client;
use crate::http::respond::answer::Answer;
use crate::http::respond::{json, response_format};
use crate::http::state::AppState;
use axum::body::{Body, Bytes};
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use bagtrack_ingest::video::VideoFormat;
use bagtrack_sessions::{Boxes, QueuePermit, SessionState, Start, box_warnings};
use bagtrack_tracker::Params;
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
    /// The targets' boxes in its first frame.
    pub boxes: Boxes,
    /// The trackers' parameters.
    pub params: Box<Params>,
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
    let (client, boxes, params) = (request.client, request.boxes, request.params);
    let (place, queue) = VideoPlace::take(&state, &client, request.queue).await?;
    let frames = VideoFrames::decode(&state, request.video, request.format, place)?;
    let mut video = VideoTrack {
        queue: queue.for_frames(boxes.as_slice().len()),
        state,
        client,
        frames,
        path: request.path,
        request_id: request.request_id,
    };
    let (line, track) = video.begin(boxes, params).await?;
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
    async fn begin(
        &mut self,
        boxes: Boxes,
        params: Box<Params>,
    ) -> Result<(Bytes, SessionState), Problem> {
        let file = self
            .frames
            .next()
            .await
            .ok_or_else(Problem::missing_frame)??;
        count_frame(&self.state, &self.client).await?;
        let given = boxes.clone();
        let start = Start::Frame {
            file,
            boxes,
            params,
        };
        let begun = self.state.service.begin_track(self.queue.clone(), start);
        let track = begun.await?;
        let warnings = box_warnings(given.as_slice(), track.source_size());
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
        track: SessionState,
        file: Bytes,
    ) -> Result<(Bytes, SessionState), Problem> {
        count_frame(&self.state, &self.client).await?;
        let service = &self.state.service;
        let track = service.continue_track(self.queue.clone(), track, file);
        let track = track.await?;
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
