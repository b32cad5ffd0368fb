//! What a client says of the frame that comes next, in a text message.

use crate::http::extract::overrides::rect;
use crate::http::problems::problem::Problem;
use bagtrack_api::FrameHeader;
use bagtrack_sessions::GivenBox;

/// Most bytes of a text message.
pub const MAX_TEXT_BYTES: usize = 4096;

/// The corrected box that the client gave with a frame, if any.
pub fn correction(header: &FrameHeader) -> Option<GivenBox> {
    let (target, to) = (header.target, header.rect.map(rect)?);
    Some(GivenBox { target, to })
}

/// What two text messages say of one frame. Where both have a field, `later` counts.
///
/// # Errors
/// The messages are about two targets.
pub fn merged(earlier: FrameHeader, later: FrameHeader) -> Result<FrameHeader, Problem> {
    let detail = "The texts before this frame name two targets; a frame takes one.";
    let merged = earlier.and(later);
    merged.ok_or_else(|| Problem::malformed(detail))
}

/// The problem of a text message that is too long to say anything of a frame.
pub fn too_long() -> Problem {
    let detail =
        format!("A text may have at most {MAX_TEXT_BYTES} bytes: send frames as binary messages.");
    Problem::malformed(detail)
}

/// Reads a text message.
///
/// # Errors
/// The text is not the JSON of a [`FrameHeader`].
pub fn parse(text: &str) -> Result<FrameHeader, Problem> {
    serde_json::from_str(text).map_err(|error| {
        let detail = format!(
            "The text message before the frame cannot be read: {error}. Send an object of `frame`, `box`, `target` and \
             `see`, or of some of them. Frames are binary messages."
        );
        Problem::malformed(detail)
    })
}
