//! A synthetic clip with exact ground truth, drawn by the program: a textured card that moves in smooth turns,
//! comes nearer, passes through a dim spell and is half covered for a while, in front of a textured wall on
//! which similar patches hang, seen by a sensor with noise.
//!
//! That is the default [`Scene`]; in others the card goes out of sight and comes back.
//!
//! The same settings draw the same clip, bit for bit, on one machine. What could go wrong: a frame so small
//! that the card has no pixels to speak of; so sizes are checked.
//!
//! ```
//! use bagtrack::sample::{Clip, Settings};
//! let clip = Clip::new(Settings { frames: 3, ..Settings::default() })?;
//! let picture = clip.draw(1);
//! let card = clip.target(1);
//! assert_eq!(picture.dimensions(), (320, 240));
//! assert!(card.x > 0.0 && card.x + card.width < 320.0);
//! # Ok::<(), bagtrack::sample::SampleError>(())
//! ```

mod draw;
mod folder;
mod scene;
mod texture;

pub use folder::Format;
pub use scene::Scene;

use crate::tracker::Rect;
use draw::Background;
use image::RgbImage;
use scene::Course;
use std::path::{Path, PathBuf};

/// Smallest side of a frame: the card is then about ten pixels wide.
pub const MIN_SIDE: u32 = 64;
/// Largest side of a frame.
pub const MAX_SIDE: u32 = 4096;

/// What the clip is to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// What happens.
    pub scene: Scene,
    /// Number of frames, [`Scene::least_frames`] or more.
    pub frames: u32,
    /// Width of a frame in pixels, [`MIN_SIDE`] to [`MAX_SIDE`].
    pub width: u32,
    /// Height of a frame in pixels, [`MIN_SIDE`] to [`MAX_SIDE`].
    pub height: u32,
    /// Chooses the path, the textures and the noise.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            scene: Scene::Default,
            frames: 150,
            width: 320,
            height: 240,
            seed: 0,
        }
    }
}

/// Why a clip cannot be drawn or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// There are too few frames, or a side is out of its range.
    #[error("{name} is {value}; it must be {expected}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// The value given.
        value: u32,
        /// The range it must be in.
        expected: String,
    },
    /// The folder or a file in it cannot be written.
    #[error("{}: {reason}", path.display())]
    Write {
        /// What was being written.
        path: PathBuf,
        /// What went wrong.
        reason: String,
    },
}

/// A clip, ready to be drawn frame by frame.
#[derive(Debug)]
pub struct Clip {
    settings: Settings,
    course: Course,
    background: Background,
}

impl Clip {
    /// Prepares the clip.
    ///
    /// # Errors
    /// [`SampleError::Setting`].
    pub fn new(settings: Settings) -> Result<Self, SampleError> {
        let out_of_range = |name, value, expected| {
            Err(SampleError::Setting {
                name,
                value,
                expected,
            })
        };
        let least = settings.scene.least_frames();
        if settings.frames < least {
            let expected = format!("{least} or more in this scene");
            return out_of_range("frames", settings.frames, expected);
        }
        for (name, side) in [("width", settings.width), ("height", settings.height)] {
            if !(MIN_SIDE..=MAX_SIDE).contains(&side) {
                return out_of_range(name, side, format!("{MIN_SIDE} to {MAX_SIDE} pixels"));
            }
        }
        Ok(Self {
            settings,
            course: Course::new(settings),
            background: Background::draw(settings),
        })
    }

    /// Number of frames.
    pub fn frames(&self) -> u32 {
        self.settings.frames
    }

    /// Where the card is in frame `index` (from 0): exactly, the part that is not seen included, in pixels from the
    /// top-left corner of the frame.
    pub fn target(&self, index: u32) -> Rect {
        self.course.target(index)
    }

    /// The share of the card's area that something in front of it covers in frame `index`, 0 to 1 (in the default
    /// scene 0 to 0.5).
    pub fn covered(&self, index: u32) -> f64 {
        self.course.covered(index)
    }

    /// The share of the card's area that is seen in frame `index`: in the frame, and not covered; 0 to 1.
    pub fn visible(&self, index: u32) -> f64 {
        self.course.visible(index)
    }

    /// Draws frame `index` (from 0).
    pub fn draw(&self, index: u32) -> RgbImage {
        draw::frame(self.settings, &self.course, &self.background, index)
    }

    /// Writes the clip into `dir` in the OTB layout: `img/0001.jpg` (or `.png`) and so on, and
    /// `groundtruth_rect.txt` with `x,y,width,height` a line, in 1-based pixels: the whole card, and `0,0,0,0` (which
    /// is not scored) while nothing of it is seen. `visible.txt` has 1 or 0 a line: whether any of it is seen. Files
    /// of these names are written over. Calls `progress` after each frame.
    ///
    /// # Errors
    /// [`SampleError::Write`].
    pub fn write(
        &self,
        dir: &Path,
        format: Format,
        progress: impl FnMut(),
    ) -> Result<(), SampleError> {
        folder::write(self, dir, format, progress)
    }
}
