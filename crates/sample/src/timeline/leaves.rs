//! The card leaves at the right edge of the frame, and comes back there.

use super::course::Course;
use crate::smoothstep::smoothstep;
use bagtrack_tracker::Rect;
use std::f64::consts::{PI, TAU};

/// Frames for which nothing of the card is seen, an odd number.
const AWAY: f64 = 25.0;
/// Frames from where the card starts to where it comes to rest, if the clip is long enough: at most 4 pixels a frame to
/// the side, at 320 x 240.
const WAY: f64 = 150.0;
/// Where the card's left edge is at the start and at the end, as a share of the frame's width.
const START: f64 = 0.4;
/// Frames in which the card goes from one height to the other.
const CLIMB: f64 = 40.0;
/// Frames from one small rise and fall to the next.
const SWAY: f64 = 43.0;

pub(super) fn target(course: &Course, index: u32) -> Rect {
    let ((frame_width, frame_height), (width, height)) = (course.size(), course.card(index));
    let frames_past_middle = course.frames_past_middle(index);
    let bend = |frames: f64| (PI * (frames / WAY).clamp(-0.5, 0.5)).cos();
    // The card's left edge crosses the frame's edge AWAY / 2 frames before and after the middle.
    let edge = bend(AWAY / 2.0);
    let x = frame_width * (1.0 + (1.0 - START) * (bend(frames_past_middle) - edge) / edge);
    let climbed = smoothstep(0.5 + frames_past_middle / CLIMB);
    let (upper, lower) = (0.28, 0.72);
    let level = if course.phase.1 < 0.5 {
        upper + (lower - upper) * climbed
    } else {
        lower + (upper - lower) * climbed
    };
    let sway = 0.03 * (TAU * f64::from(index) / SWAY).sin();
    let y = frame_height * (level + sway) - height / 2.0;
    Rect::new(x, y, width, height)
}
