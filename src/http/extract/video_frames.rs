//! The frames of an uploaded video, as an `ffmpeg` process decodes them. The process has a [place](VideoPlace).
//!
//! A client has one place at a time, so that the next place is left to another client.

use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::body::Bytes;
use bagtrack_api::ProblemKind as Kind;
use bagtrack_config::OFF;
use bagtrack_ingest::video::{
    Cost, Stop, VideoDecoder, VideoError, VideoFormat, VideoLimits, VideoPicture,
};
use bagtrack_quotas::Client;
use bagtrack_sessions::clock::{self, timeout};
use bagtrack_sessions::{QueueFull, QueuePermit};
use std::sync::Arc;
use std::thread;
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, mpsc};

/// Most decoded pictures that wait to be tracked.
const MAX_WAITING: usize = 2;
const SMALLER: &str =
    "Send it smaller: `ffmpeg -i VIDEO -vf scale=1920:-2 smaller.mp4` makes it so.";
const CODECS: &str = "Send H.264, H.265, VP8, VP9, AV1, MPEG-4, H.263 or Motion JPEG: `ffmpeg -i VIDEO clip.mp4` makes one.";

/// The frames of a video. The process that decodes it ends when this is dropped.
#[derive(Debug)]
pub struct VideoFrames {
    pictures: mpsc::Receiver<Result<VideoPicture, VideoError>>,
    patience: Duration,
    /// Most frames of a request, beside those that are passed over.
    max_frames: usize,
    /// Frames at the beginning that are decoded only to be passed over.
    passed_over: usize,
    given: usize,
    _stop: Stop,
    _place: VideoPlace,
}

impl VideoFrames {
    /// Begins to decode a video, whose process has `place`. Its first `passed_over` frames do not count for the limit.
    ///
    /// # Errors
    /// The service has no `ffmpeg`, or cannot start it.
    pub async fn decode(
        state: &AppState,
        video: Bytes,
        format: VideoFormat,
        place: VideoPlace,
        passed_over: u64,
    ) -> Result<Self, Problem> {
        let (config, limits) = (&state.config, state.config.frame_limits());
        let max_frames = config.limits.max_video_frames;
        let passed_over = usize::try_from(passed_over).unwrap_or(usize::MAX);
        let limits = VideoLimits {
            max_pixels: limits.max_pixels,
            max_bytes: limits.max_bytes,
            max_pictures: max_frames.saturating_add(passed_over),
        };
        let patience = config.work_timeout;
        if config.limits.ffmpeg == OFF {
            return Err(no_decoder());
        }
        let (launcher, program) = (
            config.limits.ffmpeg_launcher.clone(),
            config.limits.ffmpeg.clone(),
        );
        // This may block: the bytes are copied, and a process is started.
        let begin = move || VideoDecoder::of_bytes(&launcher, &program, video, format, limits);
        let begun = tokio::task::spawn_blocking(begin).await;
        let mut decoder = begun.map_err(|error| Problem::internal(Arc::new(error)))??;
        let stop = decoder.stop();
        let (send, pictures) = mpsc::channel(MAX_WAITING);
        let reading = move || {
            loop {
                let picture = decoder.next_picture().transpose();
                let (is_last, sent) = match picture {
                    None => return,
                    Some(picture) => (picture.is_err(), send.blocking_send(picture)),
                };
                if is_last || sent.is_err() {
                    return;
                }
            }
        };
        let thread = thread::Builder::new()
            .name("video".to_owned())
            .spawn(reading);
        thread.map_err(|error| Problem::internal(Arc::new(error)))?;
        Ok(Self {
            pictures,
            patience,
            max_frames,
            passed_over,
            given: 0,
            _stop: stop,
            _place: place,
        })
    }

    /// Decodes no more. The place stays taken until this is dropped.
    pub fn end(&mut self) {
        self.pictures.close();
    }

    /// The next frame; none after the last.
    pub async fn next(&mut self) -> Option<Result<VideoPicture, Problem>> {
        let next = timeout(self.patience, self.pictures.recv()).await;
        let Ok(next) = next else {
            return Some(Err(Problem::work_timeout()));
        };
        match next {
            Some(Ok(_)) if self.given == self.max_frames.saturating_add(self.passed_over) => {
                let detail = format!(
                    "A request may have at most {} frames of a video; send the rest in another one.",
                    self.max_frames
                );
                Some(Err(Problem::new(Kind::TooManyFrames, detail)))
            }
            Some(Ok(picture)) => {
                self.given += 1;
                Some(Ok(picture))
            }
            Some(Err(error)) => Some(Err(error.into())),
            None if self.given == 0 => {
                let detail = "The video has no pictures. Send the whole file again.";
                Some(Err(Problem::new(Kind::FrameDamaged, detail)))
            }
            None => None,
        }
    }
}

fn no_decoder() -> Problem {
    let detail =
        "This service has no ffmpeg to decode videos. Send its frames as JPEG, PNG or WebP.";
    Problem::new(Kind::UnsupportedImage, detail)
}

impl From<VideoError> for Problem {
    fn from(error: VideoError) -> Self {
        match error {
            VideoError::NoProgram { ref source, .. } => {
                use std::io::ErrorKind::{NotFound, PermissionDenied};
                let problem = match source.kind() {
                    NotFound | PermissionDenied => no_decoder(),
                    // Such as too many processes or open files.
                    _ => {
                        let detail = "The service cannot start ffmpeg at the moment.";
                        Self::new(Kind::QueueFull, detail)
                    }
                };
                problem.caused_by(Arc::new(error))
            }
            VideoError::NoPictures => {
                let detail = "The file has no pictures, but sound or other data.";
                Self::new(Kind::FrameDamaged, detail)
            }
            VideoError::UnreadCodec => {
                let detail = format!("The video's codec is not read here. {CODECS}");
                Self::new(Kind::UnsupportedImage, detail)
            }
            VideoError::TooCostly(Cost::Time) => {
                let detail = format!("{}. Send it in parts.", sentence(&error));
                Self::new(Kind::RequestTooCostly, detail)
            }
            VideoError::TooCostly(Cost::Memory | Cost::Pixels(_)) => {
                let detail = format!("{}. {SMALLER}", sentence(&error));
                Self::new(Kind::FrameTooLarge, detail)
            }
            VideoError::Damaged { .. } => {
                Self::new(Kind::FrameDamaged, format!("{}.", sentence(&error)))
            }
        }
    }
}

/// An error's words with a capital letter.
fn sentence(error: &VideoError) -> String {
    let mut words = error.to_string();
    words[..1].make_ascii_uppercase();
    words
}

/// The places that a video takes while it is decoded: of its client, of the client's networks, and of all. They are
/// given back when this is dropped.
#[derive(Debug)]
pub struct VideoPlace {
    _of_client: Vec<OwnedSemaphorePermit>,
    _of_all: OwnedSemaphorePermit,
}

/// Counts a frame of a video, once the client's rate of frames allows it.
///
/// # Errors
/// The rate does not allow it within the work timeout.
pub async fn count_frame(state: &AppState, client: &Client) -> Result<(), Problem> {
    let deadline = clock::now() + state.config.work_timeout;
    let account = state.clients.account(client);
    Ok(account.count_frame_in_order(deadline).await?)
}

impl VideoPlace {
    /// Waits for a place, at most for the work timeout. Meanwhile the request gives up its place in the queue. A video
    /// may take the processor time of as many requests as posts of its frames would need.
    ///
    /// # Errors
    /// No place is free in time, of the client's own or of all; or the queue is full after the wait.
    pub async fn take(
        state: &AppState,
        client: &Client,
        queue: QueuePermit,
    ) -> Result<(Self, QueuePermit), Problem> {
        let config = &state.config;
        let deadline = clock::now() + config.work_timeout;
        let request = queue.yield_place();
        let own = state.clients.account(client).video_until(deadline).await?;
        let all = state.videos.take_until(deadline).await.ok_or(QueueFull)?;
        let requests = config.limits.max_video_frames.div_ceil(config.max_frames);
        let requests = u32::try_from(requests).unwrap_or(u32::MAX);
        let queue = state.service.admission.rejoin(request)?;
        let place = Self {
            _of_client: own,
            _of_all: all,
        };
        Ok((place, queue.with_cpu_of(requests)))
    }
}
