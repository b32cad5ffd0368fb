//! What a clip is to be, and the ranges of its settings.

use super::attributes::Attributes;
use super::error::SampleError;
use super::scene::Scene;

/// Smallest side of a frame: the card is then about ten pixels wide.
pub const MIN_SIDE: u32 = 64;
/// Largest side of a frame.
pub const MAX_SIDE: u32 = 4096;

/// What the clip is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// What happens to the target.
    pub scene: Scene,
    /// Number of frames, [`Scene::min_frames`] or more.
    pub frames: u32,
    /// Width of a frame in pixels, [`MIN_SIDE`] to [`MAX_SIDE`].
    pub width: u32,
    /// Height of a frame in pixels, [`MIN_SIDE`] to [`MAX_SIDE`].
    pub height: u32,
    /// Chooses the path, the textures and the noise.
    pub seed: u64,
    /// What makes the clip hard.
    pub attributes: Attributes,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            scene: Scene::Default,
            frames: 150,
            width: 320,
            height: 240,
            seed: 0,
            attributes: Attributes::default(),
        }
    }
}

impl Settings {
    /// Checks every setting against its range.
    pub(super) fn check(&self) -> Result<(), SampleError> {
        let out_of_range = |name, value: u32, expected| {
            Err(SampleError::Setting {
                name,
                value: value.to_string(),
                expected,
            })
        };
        let least = self.scene.min_frames();
        if self.frames < least {
            let expected = format!("{least} or more in this scene");
            return out_of_range("frames", self.frames, expected);
        }
        for (name, side) in [("width", self.width), ("height", self.height)] {
            if !(MIN_SIDE..=MAX_SIDE).contains(&side) {
                return out_of_range(name, side, format!("{MIN_SIDE} to {MAX_SIDE} pixels"));
            }
        }
        self.attributes.check()
    }
}
