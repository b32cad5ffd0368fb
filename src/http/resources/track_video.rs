//! `POST /track` with a video and a box: an answer for each frame, the first one being the box. Nothing is kept.

use crate::http::extract::video_frames::VideoFrames;
use crate::http::extract::video_place::count_frame;
use crate::http::problems::problem::Problem;
use crate::http::quotas::client::Client;
use crate::http::respond::answer::Answer;
use crate::http::respond::ndjson::FrameSequence;
use crate::http::state::AppState;
use axum::body::Bytes;
use bagtrack_sessions::{Boxes, QueuePermit, SessionState, Start, box_warnings};
use bagtrack_tracker::Params;

/// A video that is tracked.
#[derive(Debug)]
pub struct VideoTrack {
    /// The service.
    pub state: AppState,
    /// The place in the queue.
    pub queue: QueuePermit,
    /// Who sends it.
    pub client: Client,
    /// The pictures.
    pub frames: VideoFrames,
    /// How far it is tracked.
    pub track: Track,
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
        let file = self.frames.next().await?;
        Some(match file {
            Ok(file) => self.track(file).await,
            Err(problem) => Err(problem),
        })
    }
}

impl VideoTrack {
    async fn track(&mut self, file: Bytes) -> Result<Answer, Problem> {
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
        let answer = Answer::from(&track.latest()).with_warnings(warnings);
        self.track = Track::At(Box::new(track));
        Ok(answer)
    }
}
