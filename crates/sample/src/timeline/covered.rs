//! The card passes behind a post, from left to right.

use super::course::Course;
use bagtrack_tracker::Rect;
use std::f64::consts::{PI, TAU};

/// Frames for which nothing of the card is seen.
const HIDDEN: u32 = 20;
/// Frames that the way from one side to the other takes: about 3 pixels a frame at the post, at 320 x 240.
const WAY: f64 = 100.0;
/// Frames from one rise and fall to the next.
const SWAY: f64 = 97.0;

pub(super) fn target(course: &Course, index: u32) -> Rect {
    let ((frame_width, frame_height), (width, height)) = (course.size(), course.card(index));
    let way = (course.frames_past_middle(index) / WAY).clamp(-0.5, 0.5);
    let sway = (TAU * (f64::from(index) / SWAY + course.phase.1)).sin();
    Rect::centered(
        frame_width * (0.5 + 0.32 * (PI * way).sin()),
        frame_height * (0.5 + 0.12 * sway),
        width,
        height,
    )
}

/// The post, which hides the whole card in the [`HIDDEN`] frames in the middle and in no others. Its left edge lies
/// half way between the card's left edges in the last frame before them and in the first of them, its right edge half
/// way between the card's right edges in the last of them and in the first frame after them.
pub(super) fn post(course: &Course) -> Rect {
    let first = course.settings.frames / 2 - HIDDEN / 2;
    let after = first + HIDDEN;
    let left = |index| target(course, index).x;
    let right = |index| {
        let card = target(course, index);
        card.x + card.width
    };
    let from = (left(first - 1) + left(first)) / 2.0;
    let to = (right(after - 1) + right(after)) / 2.0;
    Rect::new(from, 0.0, to - from, course.size().1)
}
