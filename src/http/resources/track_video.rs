//! `POST /track` with a video and a box: an answer for each frame, the first one being the box. Nothing is kept.

use crate::http::extract::video_frames::count_frame;
use crate::http::extract::video_range::{RangeFrame, RangeFrames};
use crate::http::problems::problem::Problem;
use crate::http::respond::answer::answer;
use crate::http::respond::ndjson::FrameSequence;
use crate::http::state::AppState;
use axum::body::Bytes;
use bagtrack_api::Answer;
use bagtrack_quotas::Client;
use bagtrack_sessions::{Boxes, Estimates, QueuePermit, Selection, SessionState, Start};
use bagtrack_tracker::{Params, box_warnings};
use std::sync::Arc;

/// A video that is tracked.
#[derive(Debug)]
pub struct VideoTrack {
    pub state: AppState,
    pub queue: QueuePermit,
    pub client: Client,
    /// The pictures, in the order in which they are tracked.
    pub frames: RangeFrames,
    pub track: Track,
}

/// How far a video is tracked.
#[derive(Debug)]
pub enum Track {
    /// No frame is tracked. The targets' boxes in the first frame, and the parameters.
    Start(Boxes, Box<Params>),
    /// The state after the last tracked frame.
    At(Box<SessionState>),
    /// A frame could not be tracked.
    Ended,
}

/// What was found in a frame.
#[derive(Debug)]
pub struct TrackedFrame {
    /// Its number in the video.
    pub number: u64,
    /// When it is shown, in seconds after the first frame of the video.
    pub time: f64,
    /// Its width and height in pixels.
    pub size: (u32, u32),
    pub estimates: Estimates,
    /// What may be wrong with the boxes that were given.
    pub warnings: Option<Vec<String>>,
}

impl VideoTrack {
    /// Tracks through the next frame; none after the last.
    ///
    /// # Errors
    /// The frame cannot be decoded or tracked. Then no later one is tracked.
    pub async fn next(&mut self) -> Result<Option<TrackedFrame>, Problem> {
        let Some(next) = self.frames.next().await else {
            return Ok(None);
        };
        let RangeFrame { number, time, file } = next?;
        count_frame(&self.state, &self.client).await?;
        let (track, warnings) = self.step(file).await?;
        let frame = TrackedFrame {
            number,
            time,
            size: track.source_size(),
            estimates: track.latest(),
            warnings,
        };
        self.track = Track::At(Box::new(track));
        Ok(Some(frame))
    }

    /// The track with this frame, and what may be wrong with the boxes that were given.
    async fn step(&mut self, file: Bytes) -> Result<(SessionState, Option<Vec<String>>), Problem> {
        let (service, queue) = (&self.state.service, self.queue.clone());
        match std::mem::replace(&mut self.track, Track::Ended) {
            Track::Start(boxes, params) => {
                let given = boxes.clone();
                let start = Start::Frame {
                    file,
                    boxes,
                    params,
                };
                let track = service.begin_track(queue, start).await?;
                let warnings = box_warnings(given.as_slice(), track.source_size());
                Ok((track, warnings))
            }
            Track::At(track) => Ok((service.continue_track(queue, *track, file).await?, None)),
            Track::Ended => Err(Problem::missing_frame()),
        }
    }
}

/// The answers to the frames of a video, as they are tracked.
#[derive(Debug)]
pub struct VideoAnswers {
    pub video: VideoTrack,
    pub selection: Selection<Arc<Answer>>,
    /// Why no further frame is tracked; `None` while frames are.
    pub end: Option<End>,
}

/// Why no further frame is tracked.
#[derive(Debug)]
pub enum End {
    /// All wanted frames are tracked.
    Complete,
    /// A frame was refused. Its problem is the last line.
    Refused(Problem),
}

impl FrameSequence for VideoAnswers {
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

impl VideoAnswers {
    /// Tracks through the next frame, and returns an answer to send, if any: a key frame is known one frame later.
    async fn step(&mut self) -> Result<Option<Answer>, End> {
        if self.selection.has_ended() {
            return Err(End::Complete);
        }
        let next = self.video.next().await.map_err(End::Refused)?;
        let frame = next.ok_or(End::Complete)?;
        let answer = Arc::new(Answer {
            frame: frame.number,
            ..answer(&frame.estimates, frame.warnings)
        });
        let estimates = frame.estimates.as_slice().iter();
        let rows = estimates.map(|it| (*it, answer.clone()));
        Ok(only(self.selection.take(rows)))
    }
}

/// The answer of a frame from its rows, each of which is a clone of it for a target; `None` without rows.
fn only(rows: Vec<Arc<Answer>>) -> Option<Answer> {
    rows.into_iter().next().map(Arc::unwrap_or_clone)
}
