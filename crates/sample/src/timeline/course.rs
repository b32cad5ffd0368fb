//! What all scenes share: the settings, the seed's choice of a path, the time in the clip, the size of the card.

use crate::settings::Settings;
use crate::smoothstep::smoothstep;
use bagtrack_tracker::Rect;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

/// Width of the card divided by its height.
const ASPECT: f64 = 0.8;
/// The streams of random numbers of the camera begin here, after those of the sensor's noise.
const CAMERA: u64 = 1 << 40;
/// Height of the card divided by the shorter side of the frame, at the start and at the end.
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
        let attributes = &self.settings.attributes;
        // A ratio of sizes grows evenly if its logarithm does.
        let factor = attributes.low_resolution * attributes.scale_variation.powf(grown);
        let card = width.min(height) * (HEIGHT.0 + (HEIGHT.1 - HEIGHT.0) * grown);
        let turned = (PI * self.progress(index)).sin();
        let aspect = ASPECT * (1.0 - (1.0 - attributes.out_of_plane_rotation) * turned);
        (factor * card * aspect, factor * card)
    }

    /// How far the camera has moved the picture in a frame, in whole pixels to the right and down.
    pub(super) fn camera(&self, index: u32) -> (i32, i32) {
        let most = self.size().0.min(self.size().1) * self.settings.attributes.camera_motion;
        if most == 0.0 {
            return (0, 0);
        }
        let mut random = ChaCha8Rng::seed_from_u64(self.settings.seed);
        random.set_stream(CAMERA + u64::from(index));
        let mut offset = || (most * (2.0 * random.random::<f64>() - 1.0)).round() as i32;
        (offset(), offset())
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
