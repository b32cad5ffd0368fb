//! The size in which a session works: it follows the target, not the frame.
//!
//! A target of few pixels shows little to recognise it by, and beyond a standard size more pixels do not help. So the
//! working image is such that the target has a standard size in the first frame.

use crate::image::rect::Rect;

/// The longer side of the working image in pixels, where it does not follow the target, and the least where it does:
/// the paper's pixel lengths hold at this size, and a smaller image would show too little around a large target.
pub const MIN_WORKING_SIDE: u32 = 320;
/// The longest side of a working image, in pixels. It bounds what a session costs.
pub const MAX_WORKING_SIDE: u32 = 1280;

/// The size of the working image of uploads of the size `source`, both sides above 0: never larger than the uploads,
/// the aspect kept, each side rounded to whole pixels. In it `target`, a box in the upload's pixels, has √(width ·
/// height) of `target_side` working pixels, within the limits of the working side. With a `target_side` of 0 the longer
/// side is [`MIN_WORKING_SIDE`].
pub(crate) fn working_size(source: (u32, u32), target: &Rect, target_side: f64) -> (u32, u32) {
    let longer = source.0.max(source.1);
    let wanted = f64::from(longer) * target_side / (target.width * target.height).sqrt();
    let limits = (f64::from(MIN_WORKING_SIDE), f64::from(MAX_WORKING_SIDE));
    // A box without an area is refused elsewhere.
    let side = if wanted.is_finite() { wanted } else { 0.0 };
    let side = side.clamp(limits.0, limits.1).min(f64::from(longer));
    let shrink = |length: u32| {
        let scaled = f64::from(length) * side / f64::from(longer);
        (scaled.round() as u32).clamp(1, length)
    };
    (shrink(source.0), shrink(source.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_has_its_standard_size_within_the_limits() {
        let size = |source, width, height, side| {
            working_size(source, &Rect::new(0.0, 0.0, width, height), side)
        };
        // 320 for a large target or a small upload; all pixels for a small target.
        assert_eq!(size((1280, 720), 512.0, 512.0, 64.0), (320, 180));
        assert_eq!(size((200, 300), 90.0, 90.0, 64.0), (200, 300));
        assert_eq!(size((1280, 720), 10.0, 9.0, 64.0), (1280, 720));
        assert_eq!(size((3840, 2160), 10.0, 10.0, 64.0), (1280, 720));
        // 128 pixels become 64.
        assert_eq!(size((1280, 720), 128.0, 128.0, 64.0), (640, 360));
        assert_eq!(size((1280, 720), 64.0, 256.0, 64.0), (640, 360));
        assert_eq!(size((8000, 2), 128.0, 128.0, 64.0), (1280, 1));
        assert_eq!(size((1280, 720), 10.0, 10.0, 0.0), (320, 180));
        assert_eq!(size((1280, 720), 0.0, 0.0, 64.0), (320, 180));
    }
}
