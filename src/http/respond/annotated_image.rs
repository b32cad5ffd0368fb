//! The answer to a frame as the frame itself, with box, score and particles drawn.

use super::answer::{answer, with_standing};
use super::body::charged_body;
use crate::drawing::{self, Drawn, Picture};
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::http::{HeaderName, HeaderValue};
use axum::response::{IntoResponse, Response};
use bagtrack_api::headers;
use bagtrack_quotas::Client;
use bagtrack_sessions::{Estimates, FrameBatch, PerTarget, QueuePermit, SessionPermit, WorkMeter};
use bagtrack_tracker::Diagnostics;
use std::sync::Arc;

/// The header that has the answer as JSON.
pub const ANSWER: HeaderName = HeaderName::from_static(headers::ANSWER);
/// Most pixels of a picture's longer side. This bounds the memory of a drawn answer.
const MAX_SIDE: u32 = 2048;

/// Tracks through the only frame of a request, and answers with its picture.
///
/// # Errors
/// Those of a request without a picture; also, the request has several frames, or there is no memory for the picture.
pub async fn answer_drawn(
    state: &AppState,
    permit: SessionPermit,
    queue: QueuePermit,
    client: &Client,
    mut next: FrameBatch,
) -> Result<Response, Problem> {
    let [file] = &next.files[..] else {
        let detail = "A drawn answer is one picture; send one frame in a request.";
        return Err(Problem::malformed(detail));
    };
    let size = permit.session().source_size();
    next.check_sizes(&state.service.request_limits(), size)?;
    let pixels = u64::from(size.0) * u64::from(size.1);
    let queue = queue.for_size(pixels, file.len());
    // Decoded before the frame is tracked: a frame that cannot be drawn must not count.
    let (file, limits) = (file.clone(), state.config.frame_limits());
    let decode = move |_: &mut WorkMeter| Ok(Picture::decode(&file, &limits, MAX_SIDE)?);
    let picture = state
        .service
        .run::<_, Problem, _>(queue.clone(), decode)
        .await?;
    let mut charge = state.charge(client);
    // Room for the pixels, and for a PNG file that is hardly larger.
    charge.grow(2 * picture.bytes())?;
    next.with_diagnostics = true;
    let mut answered = state.service.advance(permit, queue.clone(), next).await?;
    let (estimates, seen) = (answered.estimates.swap_remove(0), answered.diagnostics);
    let text = serde_json::to_string(&answer(&estimates, None));
    let text = text.map_err(|error| Problem::internal(Arc::new(error)))?;
    let draw = move |_: &mut WorkMeter| draw(picture, &estimates, &seen);
    let bytes = state.service.run::<_, Problem, _>(queue, draw).await?;
    let mut response = charged_body("image/png", bytes, charge).into_response();
    if let Ok(answer) = HeaderValue::from_str(&text) {
        response.headers_mut().insert(ANSWER, answer);
    }
    let (replayed, checkpoint) = (answered.replayed, answered.checkpoint);
    Ok(with_standing(replayed, checkpoint, response))
}

/// The picture with what is drawn on it, as a PNG file. A replayed answer has no particles.
fn draw(
    mut picture: Picture,
    estimates: &Estimates,
    seen: &[Diagnostics],
) -> Result<Vec<u8>, Problem> {
    let is_list = matches!(estimates, PerTarget::List(_));
    let targets = estimates.as_slice().iter().enumerate();
    let targets = targets.map(|(number, estimate)| Drawn {
        number: is_list.then_some(number),
        estimate,
        particles: seen.get(number).map_or(&[], |seen| &seen.particles),
    });
    drawing::draw(&mut picture, &targets.collect::<Vec<_>>());
    picture
        .png()
        .map_err(|error| Problem::internal(Arc::new(error)))
}
