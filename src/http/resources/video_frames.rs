//! `POST /frames`: the frames of a video as pictures, for clients that cannot decode it.

use crate::http::extract::admitted::StatelessRequest;
use crate::http::extract::video_frames::{VideoFrames, VideoPlace, count_frame};
use crate::http::problems::problem::Problem;
use crate::http::respond::video_answer;
use crate::http::state::AppState;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use bagtrack_api::ProblemKind as Kind;
use bagtrack_api::requests::{BinaryBody, DecodeSettings};
use bagtrack_ingest::video::VideoPicture;
use futures_util::{Stream, StreamExt, stream};
use std::future::ready;
use std::io;

/// JPEG files that follow each other.
const MOTION_JPEG: &str = "video/x-motion-jpeg";
/// Bytes of the marker that a JPEG file begins with.
const START_OF_IMAGE: usize = 2;
/// The marker of a comment in a JPEG file.
const COMMENT: [u8; 2] = [0xFF, 0xFE];

/// Get the frames of a video
///
/// A video (MP4, QuickTime, Matroska, WebM, GIF or Motion JPEG; H.264, H.265, VP8, VP9, AV1, MPEG-4, H.263) comes back
/// as Motion JPEG, a JPEG file after the other: every frame once, at the size of the first one, as soon as it is
/// decoded. Each file begins with a comment that tells when the frame is shown, in seconds from the video's beginning,
/// for example `time=1.533333`. The page asks for it where the browser cannot play a file. Where the rest cannot be
/// decoded, the answer is cut off after the last whole frame, and not ended.
///
/// `curl --data-binary @clip.mp4 http://localhost:8080/frames -o clip.mjpeg`
#[utoipa::path(
    post, path = "/frames", tag = "service", operation_id = "getVideoFrames",
    request_body(
        description = "The video: MP4, MOV, WebM, Matroska, GIF, or Motion JPEG as `video/x-motion-jpeg`.",
        content((BinaryBody = "application/octet-stream"))
    ),
    responses(
        (
            status = 200, description = "The frames", body = BinaryBody,
            content_type = "video/x-motion-jpeg"
        )
    )
)]
pub async fn post(
    State(state): State<AppState>,
    mut request: StatelessRequest<DecodeSettings>,
) -> Result<Response, Problem> {
    let Some(format) = request.upload.video else {
        let detail = "This path gives the frames of a video: MP4, WebM, GIF or Motion JPEG. `ffmpeg -i VIDEO clip.mp4` \
            makes one of others. A frame is posted to a session: `POST /sessions/{id}/frames`.";
        return Err(Problem::new(Kind::UnsupportedImage, detail));
    };
    let file = request.upload.files.swap_remove(0);
    let place;
    (place, request.queue) = VideoPlace::take(&state, &request.client, request.queue).await?;
    let mut video = VideoFrames::decode(&state, file, format, place, 0).await?;
    let first = next(&state, &request, &mut video).await;
    let first = first.ok_or_else(Problem::missing_frame)??;
    let client = request.client.clone();
    let frames = stream::once(ready(Ok(first))).chain(rest(state.clone(), request, video));
    let answer = ([(CONTENT_TYPE, MOTION_JPEG)], Body::from_stream(frames));
    Ok(video_answer::to_reader(
        &state,
        &client,
        answer.into_response(),
    ))
}

/// The next frame, which counts in the client's rate of frames.
async fn next(
    state: &AppState,
    request: &StatelessRequest<DecodeSettings>,
    video: &mut VideoFrames,
) -> Option<Result<Bytes, Problem>> {
    let frame = video.next().await?;
    match count_frame(state, &request.client).await {
        Ok(()) => Some(frame.map(with_time)),
        Err(problem) => Some(Err(problem)),
    }
}

/// The picture as a JPEG file whose first segment is a comment with its time.
fn with_time(VideoPicture { jpeg, time }: VideoPicture) -> Bytes {
    let comment = format!("time={time:.6}");
    // The length of a segment counts its own two bytes.
    let length = u16::try_from(comment.len() + 2).expect("a number is short");
    let begin = jpeg.len().min(START_OF_IMAGE);
    let (start, rest) = jpeg.split_at(begin);
    [
        start,
        &COMMENT,
        &length.to_be_bytes(),
        comment.as_bytes(),
        rest,
    ]
    .concat()
    .into()
}

/// The frames after the first. One that cannot be decoded becomes an error, which cuts the answer off.
fn rest(
    state: AppState,
    request: StatelessRequest<DecodeSettings>,
    video: VideoFrames,
) -> impl Stream<Item = io::Result<Bytes>> {
    stream::unfold(Some((state, request, video)), |held| async {
        let (state, request, mut video) = held?;
        match next(&state, &request, &mut video).await? {
            Ok(frame) => Some((Ok(frame), Some((state, request, video)))),
            Err(problem) => {
                request.instance.report(&state, &problem);
                Some((Err(io::Error::other("the video cannot be decoded")), None))
            }
        }
    })
}
