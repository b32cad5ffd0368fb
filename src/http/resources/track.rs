//! `POST /track`: a frame and a box, or a snapshot and the next frame, get a box and a new snapshot; a video and a box
//! get an answer for each frame ([`track_video`](super::track_video)). Nothing is kept here.

use super::track_file::TrackFile;
use super::track_video::{Track, VideoAnswers, VideoTrack};
use crate::http::extract::admitted::{StatelessRequest, Upload};
use crate::http::extract::overrides;
use crate::http::extract::video_frames::{VideoFrames, VideoPlace};
use crate::http::extract::video_range::{RangeFrames, VideoRange};
use crate::http::problems::problem::Problem;
use crate::http::respond::answer::{answer_bytes, answers};
use crate::http::respond::body::{ChargedBody, charged_json};
use crate::http::respond::{ndjson, video_answer};
use crate::http::state::AppState;
use axum::body::Bytes;
use axum::extract::State;
use axum::response::{IntoResponse, Response};
use bagtrack_api::Tracked;
use bagtrack_api::openapi::example_frames;
use bagtrack_api::requests::{BinaryBody, FormBody, JsonBody, Switch, TrackSettings};
use bagtrack_ingest::video::VideoFormat;
use bagtrack_ingest::{IngestError, unread_type};
use bagtrack_sessions::{Boxes, Charge, GivenBox, Selection, TrackFrom, TrackedAway};
use bagtrack_tracker::Params;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

type TrackForm = FormBody<TrackSettings>;
type TrackJson = JsonBody<TrackSettings>;

/// Track without a session
///
/// A first frame and a box begin a track. Every answer has a snapshot, which goes with the next frame, to this instance
/// or to another one with the same secret (`BAGTRACK_SNAPSHOT_KEYS`). Nothing is kept here, so the same request gets
/// the same answer again, but for the random seed of a new track.
///
/// A video and a box are tracked to the video's end, where the service has an `ffmpeg`: a line of JSON for each frame
/// (`application/x-ndjson`), as soon as it is tracked, the first one being the box. Where the rest cannot be tracked,
/// the last line is a problem document. `start`, `count`, `backwards`, `until_lost` and `keyframes` propagate the boxes
/// from one frame through those after it, or before it; `frame` is then the number in the video. The boxes are those of
/// `bagtrack track` with these options and the same seed. With `format` the answer is the file that the command writes,
/// when all is tracked.
///
/// `curl -N --data-binary @clip.mp4 'http://localhost:8080/track?box=10,20,30,40'`
///
/// `curl -F frame=@next.jpg -F snapshot=@last.snapshot http://localhost:8080/track`
#[utoipa::path(
    post, path = "/track", tag = "sessions", operation_id = "track",
    params(TrackSettings),
    request_body(
        description = "The frames and the snapshot. A raw frame begins a track; so does a video (MP4, MOV, \
            WebM, Matroska, GIF, Motion JPEG as `video/x-motion-jpeg`).",
        content(
            (TrackForm = "multipart/form-data"),
            (
                TrackJson = "application/json",
                example = json!({
                    "frames": [example_frames::first(), example_frames::next()],
                    "box": {"x": 10, "y": 20, "width": 30, "height": 40},
                    "seed": 7
                })
            ),
            (BinaryBody = "application/octet-stream"),
        )
    ),
    responses(
        (
            status = 200,
            description = "Where the target is, and the new snapshot; for a video, a line for each frame, or a file",
            content(
                (Tracked = "application/json"), (String = "application/x-ndjson"), (String = "text/csv"),
                (String = "text/plain"), (String = "application/xml")
            )
        )
    )
)]
pub async fn post(
    State(state): State<AppState>,
    request: StatelessRequest<TrackSettings>,
) -> Result<Response, Problem> {
    match request.upload.video {
        Some(format) => track_video(state, request, format).await,
        None => track_frames(&state, request).await,
    }
}

async fn track_frames(
    state: &AppState,
    request: StatelessRequest<TrackSettings>,
) -> Result<Response, Problem> {
    let charge = state.charge(&request.client);
    let (from, files) = asked(request.upload)?;
    let respond = move |tracked: TrackedAway| body(&tracked, charge);
    let service = &state.service;
    let body = service.track::<_, Problem, _>(request.queue, from, files, respond);
    Ok(body.await?.into_response())
}

async fn track_video(
    state: AppState,
    mut request: StatelessRequest<TrackSettings>,
    format: VideoFormat,
) -> Result<Response, Problem> {
    if request.upload.snapshot.is_some() {
        let detail = "A video begins a track; leave out the snapshot.";
        return Err(Problem::malformed(detail));
    }
    let video = request.upload.files.swap_remove(0);
    let settings = request.upload.settings;
    let (range, file) = (range(&settings)?, TrackFile::asked(&settings)?);
    let (until_lost, keyframes) = (settings.until_lost.0, settings.keyframes.0);
    let (boxes, params) = begin(settings)?;
    let (place, queue) = VideoPlace::take(&state, &request.client, request.queue).await?;
    let targets = boxes.as_slice().len();
    let pictures = VideoFrames::decode(&state, video, format, place, range.passed_over()).await?;
    let charge = state.charge(&request.client);
    let client = request.client.clone();
    let video = VideoTrack {
        queue: queue.for_frames(targets),
        frames: RangeFrames::new(pictures, range, state.charge(&request.client)),
        client: request.client,
        track: Track::Start(boxes, params),
        state: state.clone(),
    };
    if let Some(file) = file {
        let selection = Selection::new(targets, until_lost, keyframes);
        return file.respond(video, selection, charge).await;
    }
    let answers = VideoAnswers {
        video,
        selection: Selection::new(targets, until_lost, keyframes),
        end: None,
    };
    let answer = ndjson::respond(state.clone(), request.instance, answers).await?;
    Ok(video_answer::to_reader(&state, &client, answer))
}

/// Which frames of a video are tracked.
fn range(settings: &TrackSettings) -> Result<VideoRange, Problem> {
    let backwards = settings.backwards.0;
    if backwards && settings.start.is_none() {
        let detail = "`backwards` goes from `start` to frame 0: give `start`, a frame's number.";
        return Err(Problem::malformed(detail));
    }
    Ok(VideoRange {
        start: settings.start.map_or(0, |number| number.0),
        count: settings.count.map_or(u64::MAX, |number| number.0),
        backwards,
    })
}

/// The boxes and the parameters with which a new track begins.
fn begin(settings: TrackSettings) -> Result<(Boxes, Box<Params>), Problem> {
    if settings.target.is_some() {
        let detail = "`target` says which one `box` corrects; without a snapshot leave it out.";
        return Err(Problem::malformed(detail));
    }
    let params = overrides::params(settings.preset, settings.seed, settings.params)?;
    let boxes = overrides::boxes(settings.r#box, settings.boxes)?;
    Ok((boxes, Box::new(params)))
}

/// Refuses settings of videos: frames that are no video are all tracked, in their order.
fn check_no_range(settings: &TrackSettings) -> Result<(), Problem> {
    let switches = [settings.backwards, settings.until_lost, settings.keyframes];
    let is_given = settings.start.is_some() || settings.count.is_some();
    let is_file = TrackFile::asked(settings)?.is_some();
    match is_given || is_file || switches.contains(&Switch(true)) {
        true => Err(Problem::malformed(
            "`start`, `count`, `backwards`, `until_lost`, `keyframes` and `format` are for a video, and the body is none \
             that is read: an MP4, WebM or GIF, or Motion JPEG as `video/x-motion-jpeg`.",
        )),
        false => Ok(()),
    }
}

/// What the track begins with or goes on from, and its next frames.
fn asked(upload: Upload<TrackSettings>) -> Result<(TrackFrom, Vec<Bytes>), Problem> {
    let (settings, files) = (upload.settings, upload.files);
    let Some(snapshot) = upload.snapshot else {
        // A known type that is not read, such as AVI, is named, and not taken for a bad setting.
        if let Some(name) = files.first().and_then(|file| unread_type(file)) {
            return Err(IngestError::UnreadFormat(name).into());
        }
        check_no_range(&settings)?;
        let (boxes, params) = begin(settings)?;
        return Ok((TrackFrom::Start(boxes, params), files));
    };
    let allowed = TrackSettings {
        r#box: settings.r#box,
        target: settings.target,
        ..TrackSettings::default()
    };
    if settings != allowed {
        let detail =
            "A snapshot holds the parameters; leave out all settings but `box` and `target`.";
        return Err(Problem::malformed(detail));
    }
    if files.len() > 1 && allowed.r#box.is_some() {
        let detail = "A box corrects one frame; send the others in another request.";
        return Err(Problem::malformed(detail));
    }
    let target = allowed.target.map(|number| number.as_index());
    let correction = allowed.r#box.map(|to| GivenBox {
        target,
        to: overrides::rect(to),
    });
    Ok((TrackFrom::Snapshot(snapshot, correction), files))
}

/// The body of the answer, whose memory is charged before it is allocated.
fn body(tracked: &TrackedAway, mut charge: Charge) -> Result<ChargedBody, Problem> {
    let (estimates, snapshot) = (&tracked.estimates[..], &tracked.snapshot);
    // The snapshot is in memory as base64, and once more in the body.
    let text = snapshot.len().div_ceil(3) * 4;
    let targets = estimates.first().map_or(1, |first| first.as_slice().len());
    charge.grow(2 * text + answer_bytes(estimates.len(), targets))?;
    let tracked = Tracked {
        answers: answers(estimates, tracked.warnings.clone()),
        snapshot: STANDARD.encode(snapshot),
    };
    charged_json(&tracked, charge)
}
