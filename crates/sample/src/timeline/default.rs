//! The default scene: turns, a dim spell, and a board that comes up from below and covers half of the card.

use super::course::Course;
use crate::smoothstep::smoothstep;
use bagtrack_tracker::Rect;
use std::f64::consts::TAU;

/// Frames that the path takes to come back in x and in y: about 4 pixels a frame at 320 x 240.
const PERIOD: (f64, f64) = (140.0, 97.0);
/// The phase between two cards that look alike, as a share of a turn: 1 - 1 / φ with the golden ratio φ, so that no two
/// come together.
const APART: f64 = 0.381_966_011_250_105;
/// Shares of the clip's length between which it is dim, and between which the card is half covered.
const DIM: (f64, f64) = (0.25, 0.48);
const COVERED: (f64, f64) = (0.58, 0.76);

pub(super) fn target(course: &Course, index: u32) -> Rect {
    on_path(course, index, 0)
}

/// The place of the target, or of the card `number` that looks like it.
pub(super) fn on_path(course: &Course, index: u32, number: u32) -> Rect {
    let ((frame_width, frame_height), (width, height)) = (course.size(), course.card(index));
    let time = f64::from(index) * course.settings.attributes.fast_motion;
    let apart = f64::from(number) * APART;
    let turn = |period: f64, phase: f64| (TAU * (time / period + phase + apart)).sin();
    let center_x = frame_width * (0.5 + 0.3 * turn(PERIOD.0, course.phase.0));
    let center_y = frame_height * (0.5 + 0.2 * turn(PERIOD.1, course.phase.1));
    Rect::centered(center_x, center_y, width, height)
}

pub(super) fn light(course: &Course, index: u32) -> f64 {
    1.0 - 0.5 * spell(course.progress(index), DIM, 0.08)
}

pub(super) fn covered(course: &Course, index: u32) -> f64 {
    0.5 * spell(course.progress(index), COVERED, 0.05)
}

/// The board comes up from below the frame with the card's motion to the side. Its upper edge covers exactly the
/// share that [`covered`] tells.
pub(super) fn board(course: &Course, index: u32) -> Option<Rect> {
    let covered = covered(course, index);
    if covered == 0.0 {
        return None;
    }
    let card = target(course, index);
    let y = card.y + card.height * (1.0 - covered);
    let (x, width) = (card.x - 0.35 * card.width, 1.7 * card.width);
    Some(Rect::new(x, y, width, course.size().1 - y))
}

/// 1 inside the span and 0 outside it, with a smooth rise and fall of length `edge` inside its ends.
fn spell(at: f64, (from, to): (f64, f64), edge: f64) -> f64 {
    smoothstep((at - from) / edge) * smoothstep((to - at) / edge)
}
