//! What a client says of the frame that comes next, in a text message.

use crate::http::extract::overrides::rect;
use crate::http::problems::problem::Problem;
use bagtrack_api::FrameHeader;
use bagtrack_sessions::GivenBox;

const MAX_TEXT_BYTES: usize = 4096;

/// The correction, where there is one.
pub fn correction(header: &FrameHeader) -> Option<GivenBox> {
    let (target, to) = (header.target, header.rect.map(rect)?);
    Some(GivenBox { target, to })
}

/// What `later` says of a frame, and what `earlier` said beside it.
///
/// # Errors
/// They are about two targets.
pub fn merged(earlier: FrameHeader, later: FrameHeader) -> Result<FrameHeader, Problem> {
    let is_of_target = |header: &FrameHeader| header.rect.is_some() || header.see;
    let target = |header: &FrameHeader| header.target.unwrap_or(0);
    if is_of_target(&earlier) && is_of_target(&later) && target(&earlier) != target(&later) {
        let detail = "The texts before this frame name two targets; a frame takes one.";
        return Err(Problem::malformed(detail));
    }
    Ok(FrameHeader {
        frame: later.frame.or(earlier.frame),
        rect: later.rect.or(earlier.rect),
        target: later.target.or(earlier.target),
        see: later.see || earlier.see,
    })
}

/// Reads a text message.
///
/// # Errors
/// It is no such JSON.
pub fn parse(text: &str) -> Result<FrameHeader, Problem> {
    if text.len() > MAX_TEXT_BYTES {
        let detail = format!("A text message may have at most {MAX_TEXT_BYTES} bytes.");
        return Err(Problem::malformed(detail));
    }
    serde_json::from_str(text).map_err(|error| {
        let detail = format!(
            "The text message before the frame cannot be read: {error}. Send {{\"frame\": N}}, {{\"box\": …}} or \
             both."
        );
        Problem::malformed(detail)
    })
}
