//! The frames of an uploaded video, as they are decoded.

use super::video_place::VideoPlace;
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::body::Bytes;
use bagtrack_api::ProblemKind as Kind;
use bagtrack_config::OFF;
use bagtrack_ingest::video::{
    Stop, VideoDecoder, VideoError, VideoFormat, VideoLimits, VideoPicture,
};
use bagtrack_sessions::clock::timeout;
use std::sync::Arc;
use std::thread;
use std::time::Duration;
use tokio::sync::mpsc;

/// Decoded pictures that wait to be tracked.
const MAX_WAITING: usize = 2;

/// The frames of a video. Its process ends when this is dropped.
#[derive(Debug)]
pub struct VideoFrames {
    pictures: mpsc::Receiver<Result<VideoPicture, VideoError>>,
    patience: Duration,
    max_frames: usize,
    count: usize,
    _stop: Stop,
    _place: VideoPlace,
}

impl VideoFrames {
    /// Begins to decode a video, in its place.
    ///
    /// # Errors
    /// There is no program for it.
    pub async fn decode(
        state: &AppState,
        video: Bytes,
        format: VideoFormat,
        place: VideoPlace,
    ) -> Result<Self, Problem> {
        let (config, limits) = (&state.config, state.config.frame_limits());
        let max_frames = config.limits.max_video_frames;
        let limits = VideoLimits {
            max_pixels: limits.max_pixels,
            max_bytes: limits.max_bytes,
            max_pictures: max_frames,
        };
        let patience = config.work_timeout;
        if config.limits.ffmpeg == OFF {
            return Err(no_decoder());
        }
        let (launcher, program) = (
            config.limits.ffmpeg_launcher.clone(),
            config.limits.ffmpeg.clone(),
        );
        // The bytes are copied, and a process is started.
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
            count: 0,
            _stop: stop,
            _place: place,
        })
    }

    /// Decodes no more. The place stays taken until this is dropped.
    pub fn end(&mut self) {
        self.pictures.close();
    }

    /// The next frame, as a JPEG file; none after the last.
    pub async fn next(&mut self) -> Option<Result<Bytes, Problem>> {
        let picture = self.next_picture().await?;
        Some(picture.map(|picture| picture.jpeg.into()))
    }

    /// The next frame with its time; none after the last.
    pub async fn next_picture(&mut self) -> Option<Result<VideoPicture, Problem>> {
        let next = timeout(self.patience, self.pictures.recv()).await;
        let Ok(next) = next else {
            return Some(Err(Problem::work_timeout()));
        };
        self.count += usize::from(next.is_some());
        match next {
            Some(Ok(_)) if self.count > self.max_frames => {
                Some(Err(Problem::too_many_frames(self.max_frames)))
            }
            Some(Ok(picture)) => Some(Ok(picture)),
            Some(Err(error)) => Some(Err(error.into())),
            None if self.count == 0 => {
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
            VideoError::NoProgram { .. } => no_decoder().caused_by(Arc::new(error)),
            VideoError::Damaged { picture, reason } => {
                let detail = format!(
                    "The video cannot be decoded from its picture {picture} on: {reason}. The frames before count. Send MP4, WebM, GIF or Motion JPEG."
                );
                Self::new(Kind::FrameDamaged, detail)
            }
        }
    }
}
