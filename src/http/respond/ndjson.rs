//! Answers as lines of JSON (NDJSON), each as soon as its frame is tracked.
//!
//! Each frame is tracked for itself: those before one that is refused count. The refusal of the first one is the answer
//! to the request; that of a later one is the last line, a problem document. The next frame is tracked when the line
//! before it has been taken, so a slow reader holds no lines in memory. What one request may take holds for all of them
//! together: pixels, processor time, and the time until the last is tracked. A video has the processor time of as many
//! requests as its frames would be posted in, and no end but that of its frames.

use super::json;
use super::response_format;
use crate::http::extract::video_frames::VideoFrames;
use crate::http::extract::video_place::count_frame;
use crate::http::problems::document::ProblemDocument;
use crate::http::problems::problem::Problem;
use crate::http::quotas::client::Client;
use crate::http::state::AppState;
use crate::http::stream::message::StreamAnswer;
use axum::body::{Body, Bytes, HttpBody};
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use bagtrack_sessions::{
    Fingerprint, FrameBatch, QueuePermit, SessionPermit, SessionState, WorkMeter,
    check_readable_pixels,
};
use http_body::Frame;
use std::convert::Infallible;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::vec::IntoIter;
use tokio::time::{Instant, timeout_at};
use tracing::Instrument;

/// Where frames come from.
#[derive(Debug)]
pub enum FrameSource {
    /// Files of the request, and when the last has to be tracked.
    Files(IntoIter<Bytes>, Instant),
    /// A video.
    Video(VideoFrames),
}

impl FrameSource {
    /// These files, if their pixels are no more than those of one request may.
    ///
    /// # Errors
    /// They are more.
    pub async fn of_files(
        state: &AppState,
        queue: QueuePermit,
        files: Vec<Bytes>,
    ) -> Result<Self, Problem> {
        let deadline = Instant::now() + state.config.work_timeout;
        let limits = state.service.request_limits();
        let check = move |_: &mut WorkMeter| {
            check_readable_pixels(&files, &limits)?;
            Ok(files)
        };
        let files = state.service.run::<_, Problem, _>(queue, check).await?;
        Ok(Self::Files(files.into_iter(), deadline))
    }
}

/// Frames that are tracked one after the other.
#[derive(Debug)]
pub struct LineWork {
    /// The service.
    pub state: AppState,
    /// The place at the session.
    pub permit: SessionPermit,
    /// The place in the queue.
    pub queue: QueuePermit,
    /// Who sends them.
    pub client: Client,
    /// The frames.
    pub frames: FrameSource,
    /// The number of the next frame, where it is known.
    pub number: Option<u64>,
    /// The path of the request, for problems.
    pub path: String,
    /// The id of the request, for problems.
    pub request_id: String,
}

impl LineWork {
    /// The answer to the request.
    ///
    /// # Errors
    /// The problem of the first frame.
    pub async fn answer(mut self) -> Result<Response, Problem> {
        if self.number.is_some() {
            // What is compared with the number must be the newest.
            let flow = self.queue.flow();
            let session = self.permit.session();
            self.state.service.refresh(session, None, flow).await?;
        }
        let first = match self.next().await {
            Some(answered) => line(&answered?)?,
            None => return Err(Problem::missing_frame()),
        };
        let body = Body::new(Lines {
            first: Some(first),
            following: Some(self.following()),
        });
        Ok(([(CONTENT_TYPE, response_format::LINES)], body).into_response())
    }

    /// The answer to the next frame; none after the last.
    async fn next(&mut self) -> Option<Result<StreamAnswer, Problem>> {
        let file = match &mut self.frames {
            FrameSource::Files(files, deadline) => {
                let (file, deadline) = (files.next()?, *deadline);
                let tracked = timeout_at(deadline, self.track(file)).await;
                return Some(tracked.unwrap_or_else(|_| Err(Problem::work_timeout())));
            }
            FrameSource::Video(video) => video.next().await?,
        };
        Some(match file {
            Ok(file) => self.track(file).await,
            Err(problem) => Err(problem),
        })
    }

    async fn track(&mut self, file: Bytes) -> Result<StreamAnswer, Problem> {
        let state = &self.state;
        let (permit, queue) = (self.permit.share(), self.queue.clone());
        let session = permit.session().clone();
        if let Some(number) = self.number
            && number <= session.latest_frame()
        {
            // It was answered before.
            let print = Fingerprint::of(&file);
            let read = move |state: &SessionState| Ok(state.stored_answer(number, print)?);
            let read = state.service.read::<_, Problem, _>(permit, queue, read);
            let estimates = read.await?;
            self.number = Some(number + 1);
            let answer = StreamAnswer::new(&estimates, 0, true, state.is_draining());
            return Ok(answer.with_checkpoint(session.checkpoint()));
        }
        if matches!(self.frames, FrameSource::Video(_)) {
            count_frame(&self.state, &self.client).await?;
        }
        let mut next = FrameBatch::posted(self.number, vec![file], None);
        // So that the request can be sent again when its line breaks.
        next.min_answers = state.config.max_frames;
        let answered = state.service.advance(permit, queue, next).await?;
        let estimates = &answered.estimates[0];
        // No other request may come between two frames of this one.
        self.number = Some(estimates.first().frame + 1);
        let answer = StreamAnswer::new(estimates, 0, answered.replayed, state.is_draining());
        Ok(answer.with_checkpoint(answered.checkpoint))
    }

    /// The next line, and what follows it.
    fn following(mut self) -> Following {
        let following = async move {
            match self.next().await? {
                Ok(answer) => match line(&answer) {
                    Ok(line) => Some((line, Some(self))),
                    Err(problem) => Some((self.last(&problem), None)),
                },
                Err(problem) => Some((self.last(&problem), None)),
            }
        };
        Box::pin(following.instrument(tracing::Span::current()))
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

fn line(value: &impl serde::Serialize) -> Result<Bytes, Problem> {
    let line = json::line(value).map(Bytes::from);
    line.map_err(|error| Problem::internal(std::sync::Arc::new(error)))
}

type Following = Pin<Box<dyn Future<Output = Option<(Bytes, Option<LineWork>)>> + Send>>;

/// The lines as a body. When it is dropped, the frames that are left are not tracked.
struct Lines {
    first: Option<Bytes>,
    following: Option<Following>,
}

impl HttpBody for Lines {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        if let Some(first) = self.first.take() {
            return Poll::Ready(Some(Ok(Frame::data(first))));
        }
        let Some(following) = &mut self.following else {
            return Poll::Ready(None);
        };
        let next = ready!(following.as_mut().poll(cx));
        self.following = None;
        Poll::Ready(next.map(|(line, work)| {
            self.following = work.map(LineWork::following);
            Ok(Frame::data(line))
        }))
    }
}
