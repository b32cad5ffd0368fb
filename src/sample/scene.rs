//! What happens in the clip, frame by frame: where the card is, how large, how bright, how much of it is covered.

use super::Settings;
use crate::tracker::Rect;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Width of the card by its height.
const ASPECT: f64 = 0.8;
/// Height of the card by the shorter side of the frame, at the start and at the end.
const HEIGHT: (f64, f64) = (0.24, 0.36);
/// Frames that the path takes to come back in x and in y: about 4 pixels a frame at 320 x 240.
const PERIOD: (f64, f64) = (140.0, 97.0);
/// Shares of the clip's length between which it is dim, and between which the card is half covered.
const DIM: (f64, f64) = (0.25, 0.48);
const COVERED: (f64, f64) = (0.58, 0.76);

/// The course of events.
#[derive(Debug)]
pub(super) struct Scene {
    settings: Settings,
    phase: (f64, f64),
}

impl Scene {
    pub(super) fn new(settings: Settings) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
        Self {
            settings,
            phase: (random.random(), random.random()),
        }
    }

    /// How far into the clip a frame is, 0 to 1.
    fn progress(&self, index: u32) -> f64 {
        f64::from(index) / f64::from(self.settings.frames.max(2) - 1)
    }

    pub(super) fn target(&self, index: u32) -> Rect {
        let (frame_width, frame_height) = (
            f64::from(self.settings.width),
            f64::from(self.settings.height),
        );
        let grown = smooth(self.progress(index));
        let height = frame_width.min(frame_height) * (HEIGHT.0 + (HEIGHT.1 - HEIGHT.0) * grown);
        let width = height * ASPECT;
        let turn = |period: f64, phase: f64| (TAU * (f64::from(index) / period + phase)).sin();
        let center_x = frame_width * (0.5 + 0.3 * turn(PERIOD.0, self.phase.0));
        let center_y = frame_height * (0.5 + 0.2 * turn(PERIOD.1, self.phase.1));
        Rect {
            x: center_x - width / 2.0,
            y: center_y - height / 2.0,
            width,
            height,
        }
    }

    /// Factor on all light.
    pub(super) fn light(&self, index: u32) -> f64 {
        1.0 - 0.5 * spell(self.progress(index), DIM, 0.08)
    }

    pub(super) fn covered(&self, index: u32) -> f64 {
        0.5 * spell(self.progress(index), COVERED, 0.05)
    }

    /// The board in front of the card: it comes up from below the frame with the card's motion to the side.
    /// Its upper edge covers exactly the share that [`Scene::covered`] tells.
    pub(super) fn board(&self, index: u32) -> Option<Rect> {
        let covered = self.covered(index);
        if covered == 0.0 {
            return None;
        }
        let card = self.target(index);
        let y = card.y + card.height * (1.0 - covered);
        Some(Rect {
            x: card.x - 0.35 * card.width,
            y,
            width: 1.7 * card.width,
            height: f64::from(self.settings.height) - y,
        })
    }
}

/// 0 outside of the span, 1 inside, with soft edges of `edge`.
fn spell(at: f64, (from, to): (f64, f64), edge: f64) -> f64 {
    smooth((at - from) / edge) * smooth((to - at) / edge)
}

/// From 0 to 1 with level ends.
pub(super) fn smooth(at: f64) -> f64 {
    let at = at.clamp(0.0, 1.0);
    at * at * (3.0 - 2.0 * at)
}
