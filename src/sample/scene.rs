//! What happens in the clip, frame by frame: where the card is, how large, how bright, and what stands before it.

mod covered;
mod default;
mod leaves;

use super::Settings;
use crate::tracker::Rect;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Width of the card by its height.
const ASPECT: f64 = 0.8;
/// Height of the card by the shorter side of the frame, at the start and at the end.
const HEIGHT: (f64, f64) = (0.24, 0.36);

/// Shares of the card below this are none.
const ROUNDING: f64 = 1e-9;

/// What happens to the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scene {
    /// It moves in smooth turns, comes nearer, passes through a dim spell, and is half covered for a while. It is
    /// always in sight.
    #[default]
    Default,
    /// It passes behind a broad post that stands from the top of the frame to the bottom: for 20 frames in the middle
    /// of the clip nothing of it is seen, and it comes out on the other side. The post does not move, so nothing tells
    /// where the target is behind it.
    Covered,
    /// It leaves the frame at one side: for 25 frames in the middle of the clip nothing of it is seen, and it comes
    /// back at the same side, but higher or lower by about two of its heights.
    Leaves,
}

impl Scene {
    /// The least number of frames: the target must be in full sight before and after.
    pub fn least_frames(self) -> u32 {
        match self {
            Scene::Default => 1,
            Scene::Covered | Scene::Leaves => 90,
        }
    }
}

/// The course of events.
#[derive(Debug)]
pub(super) struct Course {
    settings: Settings,
    /// Two numbers in [0, 1) by which the seed chooses the path.
    phase: (f64, f64),
}

impl Course {
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

    /// Frames from the one in the middle of the clip, negative before it.
    fn frames_past_middle(&self, index: u32) -> f64 {
        f64::from(index) - f64::from(self.settings.frames / 2)
    }

    fn size(&self) -> (f64, f64) {
        (
            f64::from(self.settings.width),
            f64::from(self.settings.height),
        )
    }

    /// Width and height of the card: it comes nearer.
    fn card(&self, index: u32) -> (f64, f64) {
        let (width, height) = self.size();
        let grown = smooth(self.progress(index));
        let card = width.min(height) * (HEIGHT.0 + (HEIGHT.1 - HEIGHT.0) * grown);
        (card * ASPECT, card)
    }

    /// `area` seen in a mirror, left for right, for half of the seeds.
    fn mirrored(&self, area: Rect) -> Rect {
        if self.phase.0 < 0.5 {
            return area;
        }
        Rect {
            x: self.size().0 - area.x - area.width,
            ..area
        }
    }

    pub(super) fn target(&self, index: u32) -> Rect {
        match self.settings.scene {
            Scene::Default => default::target(self, index),
            Scene::Covered => self.mirrored(covered::target(self, index)),
            Scene::Leaves => self.mirrored(leaves::target(self, index)),
        }
    }

    /// Factor on all light.
    pub(super) fn light(&self, index: u32) -> f64 {
        match self.settings.scene {
            Scene::Default => default::light(self, index),
            Scene::Covered | Scene::Leaves => 1.0,
        }
    }

    /// What stands before the card.
    pub(super) fn board(&self, index: u32) -> Option<Rect> {
        match self.settings.scene {
            Scene::Default => default::board(self, index),
            Scene::Covered => Some(self.mirrored(covered::post(self))),
            Scene::Leaves => None,
        }
    }

    /// The share of the card that the board covers.
    pub(super) fn covered(&self, index: u32) -> f64 {
        match self.settings.scene {
            Scene::Default => default::covered(self, index),
            Scene::Covered | Scene::Leaves => {
                let card = self.target(index);
                let covered = |board: Rect| card.intersection(&board) / card.area();
                self.board(index).map_or(0.0, covered)
            }
        }
    }

    /// The share of the card that is in the frame and not covered.
    pub(super) fn visible(&self, index: u32) -> f64 {
        let card = self.target(index);
        let (width, height) = self.size();
        let inside = card.intersection(&Rect::new(0.0, 0.0, width, height)) / card.area();
        let visible = inside - self.covered(index);
        // Rounding leaves a little where there is nothing, and takes a little where there is all.
        match visible {
            ..ROUNDING => 0.0,
            visible if visible > 1.0 - ROUNDING => 1.0,
            visible => visible,
        }
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
