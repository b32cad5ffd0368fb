//! `POST /track` with a video and a box: an answer for each frame, the first one being the box. Nothing is kept.

use crate::http::extract::video_place::count_frame;
use crate::http::extract::video_range::RangeFrames;
use crate::http::problems::problem::Problem;
use crate::http::quotas::client::Client;
use crate::http::respond::answer::answer;
use crate::http::respond::ndjson::FrameSequence;
use crate::http::state::AppState;
use axum::body::Bytes;
use bagtrack_api::Answer;
use bagtrack_sessions::{Boxes, QueuePermit, Selection, SessionState, Start, box_warnings};
use bagtrack_tracker::{Estimate, Params};
use std::sync::Arc;

/// A video that is tracked.
#[derive(Debug)]
pub struct VideoTrack {
    /// The service.
    pub state: AppState,
    /// The place in the queue.
    pub queue: QueuePermit,
    /// Who sends it.
    pub client: Client,
    /// The pictures, in the order in which they are tracked.
    pub frames: RangeFrames,
    /// How far it is tracked.
    pub track: Track,
    /// Which answers are given.
    pub selection: Selection<Arc<Answer>>,
    /// Why no further frame is tracked, once there is none.
    pub end: Option<End>,
}

/// Why no further frame is tracked.
#[derive(Debug)]
pub enum End {
    /// All that were wanted are.
    Complete,
    /// This is the last line.
    Refused(Problem),
}

/// How far a video is tracked.
#[derive(Debug)]
pub enum Track {
    /// It begins with these targets in the first frame.
    Start(Boxes, Box<Params>),
    /// Up to here.
    At(Box<SessionState>),
    /// A frame could not be tracked.
    Ended,
}

impl FrameSequence for VideoTrack {
    type Answer = Answer;

    async fn next(&mut self) -> Option<Result<Answer, Problem>> {
        while self.end.is_none() {
            match self.step().await {
                Ok(given) => {
                    if let Some(answer) = given {
                        return Some(Ok(answer));
                    }
                }
                Err(end) => self.end = Some(end),
            }
        }
        if let Some(answer) = only(self.selection.finish()) {
            return Some(Ok(answer));
        }
        match self.end.replace(End::Complete) {
            Some(End::Refused(problem)) => Some(Err(problem)),
            _ => None,
        }
    }
}

/// The answer of a frame, whose rows are the same for each target; none where no row is given.
fn only(rows: Vec<Arc<Answer>>) -> Option<Answer> {
    rows.into_iter().next().map(Arc::unwrap_or_clone)
}

impl VideoTrack {
    /// Tracks through the next frame, and gives the answer that is known to be wanted now.
    async fn step(&mut self) -> Result<Option<Answer>, End> {
        if self.selection.has_ended() {
            return Err(End::Complete);
        }
        let (number, file) = match self.frames.next().await {
            None => return Err(End::Complete),
            Some(next) => next.map_err(End::Refused)?,
        };
        let (estimates, answer) = self.track(file).await.map_err(End::Refused)?;
        let answer = Arc::new(Answer {
            frame: number,
            ..answer
        });
        let rows = estimates.into_iter().map(|it| (it, answer.clone()));
        Ok(only(self.selection.take(rows)))
    }

    /// The answers for the targets in a frame, and the line of it.
    async fn track(&mut self, file: Bytes) -> Result<(Vec<Estimate>, Answer), Problem> {
        count_frame(&self.state, &self.client).await?;
        let (service, queue) = (&self.state.service, self.queue.clone());
        let (track, warnings) = match std::mem::replace(&mut self.track, Track::Ended) {
            Track::Start(boxes, params) => {
                let given = boxes.clone();
                let start = Start::Frame {
                    file,
                    boxes,
                    params,
                };
                let track = service.begin_track(queue, start).await?;
                let warnings = box_warnings(given.as_slice(), track.source_size());
                (track, warnings)
            }
            Track::At(track) => (service.continue_track(queue, *track, file).await?, None),
            Track::Ended => return Err(Problem::missing_frame()),
        };
        let estimates = track.latest();
        let answer = answer(&estimates, warnings);
        self.track = Track::At(Box::new(track));
        Ok((estimates.as_slice().to_vec(), answer))
    }
}
