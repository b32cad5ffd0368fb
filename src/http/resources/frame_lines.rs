//! The frames of a post that are answered by lines, or of a video.
//!
//! The limits of one request hold for all frames together: pixels, processor time, and the time until the last is
//! tracked. A video may take the processor time of as many requests as posts of its frames would need, and has no
//! deadline.

use super::frames::FramesRequest;
use crate::http::extract::video_frames::{VideoFrames, VideoPlace, count_frame};
use crate::http::problems::problem::Problem;
use crate::http::respond::answer::stream_answer;
use crate::http::respond::ndjson::{self, FrameSequence};
use crate::http::respond::video_answer;
use crate::http::state::AppState;
use axum::body::Bytes;
use axum::response::Response;
use bagtrack_api::{ProblemKind as Kind, StreamAnswer};
use bagtrack_ingest::video::VideoFormat;
use bagtrack_quotas::Client;
use bagtrack_sessions::clock::{self, Instant, timeout_at};
use bagtrack_sessions::{
    Fingerprint, FrameBatch, KEPT_ANSWERS, QueuePermit, SessionPermit, SessionState, WorkMeter,
    check_readable_pixels,
};
use std::vec::IntoIter;

/// Answers the frames by lines.
///
/// # Errors
/// The frames have more pixels than one request may have; or the problem of the first frame.
pub async fn respond(state: AppState, mut request: FramesRequest) -> Result<Response, Problem> {
    let deadline = clock::now() + state.config.work_timeout;
    let limits = state.service.request_limits();
    let files = std::mem::take(&mut request.upload.files);
    let check = move |_: &mut WorkMeter| {
        check_readable_pixels(&files, &limits)?;
        Ok(files)
    };
    let checked = state
        .service
        .run::<_, Problem, _>(request.queue.clone(), check);
    let files = checked.await?;
    let count = files.len();
    let source = FrameSource::Files(files.into_iter(), deadline);
    respond_to(state, request, source, count).await
}

/// Answers the pictures of the only file by lines.
///
/// # Errors
/// There is no place to decode the video, or no `ffmpeg`; or the problem of the first picture.
pub async fn respond_to_video(
    state: AppState,
    mut request: FramesRequest,
    format: VideoFormat,
) -> Result<Response, Problem> {
    let video = request.upload.files.swap_remove(0);
    let place;
    (place, request.queue) = VideoPlace::take(&state, &request.client, request.queue).await?;
    let client = request.client.clone();
    let source = FrameSource::Video(VideoFrames::decode(&state, video, format, place, 0).await?);
    let answer = respond_to(state.clone(), request, source, 1).await?;
    Ok(video_answer::to_reader(&state, &client, answer))
}

async fn respond_to(
    state: AppState,
    request: FramesRequest,
    source: FrameSource,
    count: usize,
) -> Result<Response, Problem> {
    let session = request.permit.session().clone();
    let number = request.number();
    if number.is_some() {
        // The client's number is compared with the latest frame, and the store may have a later one.
        let flow = request.queue.flow();
        state.service.refresh(&session, None, flow).await?;
    }
    let frames = SessionFrames {
        state: state.clone(),
        queue: request.queue.for_frames(session.target_count()),
        permit: request.permit,
        client: request.client,
        source,
        count,
        number,
        too_old: None,
    };
    ndjson::respond(state, request.instance, frames).await
}

/// Where frames come from.
#[derive(Debug)]
enum FrameSource {
    /// The files of the request, and the time by which the last has to be tracked.
    Files(IntoIter<Bytes>, Instant),
    Video(VideoFrames),
}

/// Frames of a session that are tracked one after the other.
#[derive(Debug)]
struct SessionFrames {
    state: AppState,
    permit: SessionPermit,
    queue: QueuePermit,
    client: Client,
    source: FrameSource,
    /// How many files the request has.
    count: usize,
    /// The number of the next frame, where it is known.
    number: Option<u64>,
    /// The problem of the last picture of a video, if it got no line because its answer is no longer stored.
    too_old: Option<Problem>,
}

impl FrameSequence for SessionFrames {
    type Answer = StreamAnswer;

    async fn next(&mut self) -> Option<Result<StreamAnswer, Problem>> {
        if let FrameSource::Files(files, deadline) = &mut self.source {
            let (left, file, deadline) = (files.len(), files.next()?, *deadline);
            let tracked = timeout_at(deadline, self.answer(file)).await;
            let tracked = tracked.unwrap_or_else(|_| Err(Problem::work_timeout()));
            return Some(tracked.map_err(|problem| match self.count {
                1 => problem,
                count => problem.at_frame(count - left),
            }));
        }
        loop {
            let file = match self.picture().await? {
                Ok(file) => file,
                Err(problem) => return Some(Err(problem)),
            };
            match self.answer(file).await {
                // A long video that is sent again goes on: pictures whose answers are no longer stored get no line.
                Err(problem) if self.is_too_old(&problem) => self.pass_over(problem),
                answer => {
                    self.too_old = None;
                    return Some(answer);
                }
            }
        }
    }
}

impl SessionFrames {
    /// The next picture of the video. After the last one: the problem in `too_old`, if there is one, and then `None`.
    async fn picture(&mut self) -> Option<Result<Bytes, Problem>> {
        let FrameSource::Video(video) = &mut self.source else {
            return None;
        };
        match video.next().await {
            Some(Ok(picture)) => Some(Ok(picture.jpeg.into())),
            Some(Err(problem)) => Some(Err(problem)),
            None => self.too_old.take().map(Err),
        }
    }

    fn is_too_old(&self, problem: &Problem) -> bool {
        let latest = self.permit.session().latest_frame();
        problem.kind() == Kind::FrameOutOfOrder
            && self.number.is_some_and(|number| number <= latest)
    }

    fn pass_over(&mut self, problem: Problem) {
        self.too_old = Some(problem);
        self.number = self.number.map(|number| number + 1);
    }

    async fn answer(&mut self, file: Bytes) -> Result<StreamAnswer, Problem> {
        if let Some(number) = self.number
            && number <= self.permit.session().latest_frame()
        {
            return self.stored_answer(number, &file).await;
        }
        if matches!(self.source, FrameSource::Video(_)) {
            count_frame(&self.state, &self.client).await?;
        }
        let mut next = FrameBatch::posted(self.number, vec![file], None);
        // So that the request can be sent again after its connection broke.
        next.min_answers = self.state.config.max_frames.max(KEPT_ANSWERS);
        let (service, queue) = (&self.state.service, self.queue.clone());
        let tracked = service.advance(self.permit.share(), queue, next).await?;
        let estimates = &tracked.estimates[0];
        // With this number the next frame is refused if a frame of another request came between.
        self.number = Some(estimates.first().frame + 1);
        Ok(StreamAnswer {
            replayed: tracked.replayed,
            checkpoint: tracked.checkpoint,
            draining: self.state.is_draining(),
            ..stream_answer(estimates, None)
        })
    }

    /// The answer to a frame that was answered before.
    async fn stored_answer(&mut self, number: u64, file: &Bytes) -> Result<StreamAnswer, Problem> {
        let print = Fingerprint::of(file);
        let read = move |state: &SessionState| Ok(state.stored_answer(number, print)?);
        let (service, permit) = (&self.state.service, self.permit.share());
        let read = service.read::<_, Problem, _>(permit, self.queue.clone(), read);
        let estimates = read.await?;
        self.number = Some(number + 1);
        Ok(StreamAnswer {
            replayed: true,
            checkpoint: self.permit.session().checkpoint(),
            draining: self.state.is_draining(),
            ..stream_answer(&estimates, None)
        })
    }
}
