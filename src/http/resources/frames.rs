//! `POST /sessions/{id}/frames`: the next frame, or several, get their boxes.

use super::frame_lines;
use crate::http::extract::admitted::SessionRequest;
use crate::http::extract::answer_form::AnswerForm;
use crate::http::problems::problem::Problem;
use crate::http::respond::annotated_image::answer_drawn;
use crate::http::respond::answer::{answer_bytes, answers, with_standing};
use crate::http::respond::body::charged_json;
use crate::http::state::AppState;
use axum::extract::State;
use axum::response::Response;
use bagtrack_api::FrameAnswers;
use bagtrack_api::openapi::example_frames;
use bagtrack_api::requests::{BinaryBody, FormBody, FramesSettings, JsonBody};
use bagtrack_sessions::FrameBatch;

pub type FramesRequest = SessionRequest<FramesSettings>;

impl FramesRequest {
    /// The number of the (first) frame, where the client numbers them.
    pub fn number(&self) -> Option<u64> {
        self.upload.settings.frame.map(|number| number.0)
    }
}

type FramesForm = FormBody<FramesSettings>;
type FramesJson = JsonBody<FramesSettings>;

/// Send the next frame, or several
///
/// The answer is that to the last frame. Where several were sent, in order, `answers` has one for each of them. The
/// headers of all files are checked before the first is decoded, and if one frame is bad, none is taken. In a session
/// that was opened with `boxes` an answer has an array `targets`, in the order of the boxes, and its own box is the
/// first's.
///
/// Numbered frames can be sent again: `?frame=N` says that the (first) frame of this request is frame N. The next
/// number is processed. One that is up to 16 ahead of it waits for its turn, at most two seconds. Those of the last 32
/// frames, or of the last request, with the same bytes get the stored answers again, with the header `Replayed: true`.
/// All others answer `frame-out-of-order`, and a known number with other bytes `frame-differs`.
///
/// With `Accept: application/x-ndjson` each frame is answered by a line of JSON as soon as it is tracked. Frames before
/// one that is refused count then; its problem document is the last line. So is a video answered, where the service has
/// an `ffmpeg`. With `Accept: image/png` or `draw` the answer is the frame with boxes, scores and particles drawn on
/// it, reduced to at most 2048 pixels on its longer side.
///
/// `curl --data-binary @next.jpg http://localhost:8080/sessions/$ID/frames`
#[utoipa::path(
    post, path = "/sessions/{id}/frames", tag = "sessions", operation_id = "postFrames",
    params(
        ("id" = Uuid, Path, description = "The session's id"),
        FramesSettings,
    ),
    request_body(
        description = "The frame as a raw body (JPEG, PNG, WebP, or a video: MP4, MOV, WebM, Matroska, GIF, Motion JPEG \
            as `video/x-motion-jpeg`), as a form, or as JSON with base64. The last two take several frames.",
        content(
            (BinaryBody = "application/octet-stream"),
            (FramesForm = "multipart/form-data"),
            (FramesJson = "application/json", example = json!({"frame": example_frames::next()})),
        )
    ),
    responses(
        (
            status = 200, description = "Where the target is",
            content(
                (FrameAnswers = "application/json"), (String = "application/x-ndjson"), (BinaryBody = "image/png")
            ),
            headers(
                ("Replayed" = bool, description = "`true` where these answers were given before"),
                ("Answer" = String, description = "With a picture: the answer as JSON"),
                ("Checkpoint" = u64, description = "With a store: the last frame whose state is in it"),
                ("Draining" = bool, description = "`true` where the service is about to end")
            )
        )
    )
)]
pub async fn post(
    State(state): State<AppState>,
    mut request: FramesRequest,
) -> Result<Response, Problem> {
    let number = request.number();
    let turn = state
        .service
        .wait_for_turn(&request.permit, request.queue, number);
    request.queue = turn.await?;
    let form = match request.upload.settings.draw.0 {
        true => AnswerForm::Picture,
        false => request.form,
    };
    match (request.upload.video.take(), form) {
        (Some(_), AnswerForm::Picture) => {
            let detail = "A drawn answer is one picture; leave out `draw` for a video.";
            Err(Problem::malformed(detail))
        }
        (Some(format), _) => frame_lines::respond_to_video(state, request, format).await,
        (None, AnswerForm::Lines) => frame_lines::respond(state, request).await,
        (None, AnswerForm::Picture) => respond_drawn(&state, request).await,
        (None, AnswerForm::Json) => respond_at_once(&state, request).await,
    }
}

/// All frames are tracked before the first is answered.
async fn respond_at_once(state: &AppState, request: FramesRequest) -> Result<Response, Problem> {
    let targets = request.permit.session().target_count();
    let batch = FrameBatch::posted(request.number(), request.upload.files, None);
    let queue = request.queue.for_frames(batch.files.len() * targets);
    // Charged before the frames are tracked: a frame that cannot be answered must not count.
    let mut charge = state.charge(&request.client);
    charge.grow(answer_bytes(batch.files.len(), targets))?;
    let tracked = state.service.advance(request.permit, queue, batch).await?;
    let answers = charged_json(&answers(&tracked.estimates, None), charge)?;
    Ok(with_standing(tracked.replayed, tracked.checkpoint, answers))
}

async fn respond_drawn(state: &AppState, request: FramesRequest) -> Result<Response, Problem> {
    let batch = FrameBatch::posted(request.number(), request.upload.files, None);
    let queue = request.queue;
    let queue = queue.for_frames(request.permit.session().target_count());
    answer_drawn(state, request.permit, queue, &request.client, batch).await
}
