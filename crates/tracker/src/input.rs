//! What a caller may give: boxes and frames.

use crate::error::TrackerError;
use crate::image::frame::Frame;
use crate::image::rect::Rect;

/// The shortest side of a box, in pixels of the uploaded frame.
pub const MIN_BOX_SIDE: f64 = 4.0;

/// The factors, along x and along y, from pixels of an upload of size `source` to those of its working image of size
/// `working`.
pub(crate) fn to_working(source: (u32, u32), working: (u32, u32)) -> (f64, f64) {
    (
        f64::from(working.0) / f64::from(source.0),
        f64::from(working.1) / f64::from(source.1),
    )
}

/// Checks a box given in the pixels of an uploaded frame of size `source`: finite, at least [`MIN_BOX_SIDE`] on each
/// side and at least one pixel of the working image of size `working`, no side longer than four times the frame's
/// longer side, and over the frame by at least one pixel along x and along y.
pub(crate) fn check_target(
    source: (u32, u32),
    working: (u32, u32),
    target: &Rect,
) -> Result<(), TrackerError> {
    let refuse = |reason| Err(TrackerError::Target(reason));
    let values = [target.x, target.y, target.width, target.height];
    if !values.iter().all(|value| value.is_finite()) {
        return refuse("is not finite");
    }
    if target.width < MIN_BOX_SIDE || target.height < MIN_BOX_SIDE {
        return refuse("is too small: each side must be at least 4 pixels");
    }
    let (horizontal, vertical) = to_working(source, working);
    if target.width * horizontal < 1.0 || target.height * vertical < 1.0 {
        return refuse(
            "is too small: each side must be at least a pixel of the working image (320 pixels on the longer side, or more)",
        );
    }
    let limit = max_box_side(source);
    if target.width > limit || target.height > limit {
        return refuse("is too large: no side may be over four times the frame's longer side");
    }
    let (width, height) = (f64::from(source.0), f64::from(source.1));
    let across = (target.x + target.width).min(width) - target.x.max(0.0);
    let down = (target.y + target.height).min(height) - target.y.max(0.0);
    if across < 1.0 || down < 1.0 {
        return refuse("is outside the frame: at least one pixel of it must be inside");
    }
    Ok(())
}

/// The longest side of a box, in pixels of uploaded frames of size `source`: four times the frame's longer side.
pub(crate) fn max_box_side(source: (u32, u32)) -> f64 {
    4.0 * f64::from(source.0.max(source.1)).max(MIN_BOX_SIDE)
}

/// Checks that `frame` has the size of the session's frames.
pub(crate) fn check_frame(source: (u32, u32), frame: &Frame) -> Result<(), TrackerError> {
    let (got_width, got_height) = frame.source_size();
    if (got_width, got_height) == source {
        return Ok(());
    }
    Err(TrackerError::FrameSize {
        width: source.0,
        height: source.1,
        got_width,
        got_height,
    })
}
