//! What all scenes share: the settings, the seed's choice of a path, the time in the clip, the size of the card.

use crate::settings::Settings;
use crate::smoothstep::smoothstep;
use bagtrack_tracker::Rect;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Width of the card by its height.
const ASPECT: f64 = 0.8;
/// Height of the card by the shorter side of the frame, at the start and at the end.
const HEIGHT: (f64, f64) = (0.24, 0.36);

/// The settings of a clip, and what follows from them in every scene.
#[derive(Debug)]
pub(super) struct Course {
    pub(super) settings: Settings,
    /// Two numbers in [0, 1) by which the seed chooses the path.
    pub(super) phase: (f64, f64),
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
    pub(super) fn progress(&self, index: u32) -> f64 {
        f64::from(index) / f64::from(self.settings.frames.max(2) - 1)
    }

    /// Frames from the one in the middle of the clip, negative before it.
    pub(super) fn frames_past_middle(&self, index: u32) -> f64 {
        f64::from(index) - f64::from(self.settings.frames / 2)
    }

    pub(super) fn size(&self) -> (f64, f64) {
        (
            f64::from(self.settings.width),
            f64::from(self.settings.height),
        )
    }

    /// Width and height of the card: it comes nearer.
    pub(super) fn card(&self, index: u32) -> (f64, f64) {
        let (width, height) = self.size();
        let grown = smoothstep(self.progress(index));
        let card = width.min(height) * (HEIGHT.0 + (HEIGHT.1 - HEIGHT.0) * grown);
        (card * ASPECT, card)
    }

    /// `area` seen in a mirror, left for right, for half of the seeds.
    pub(super) fn mirrored(&self, area: Rect) -> Rect {
        if self.phase.0 < 0.5 {
            return area;
        }
        Rect {
            x: self.size().0 - area.x - area.width,
            ..area
        }
    }
}
