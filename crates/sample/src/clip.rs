//! A clip: frames that are drawn on demand, and where the target is in each.

use super::draw::{self, Background};
use super::error::SampleError;
use super::settings::Settings;
use super::timeline::Timeline;
use bagtrack_tracker::Rect;
use image::RgbImage;

/// A clip, ready to be drawn frame by frame.
#[derive(Debug)]
pub struct Clip {
    settings: Settings,
    timeline: Timeline,
    background: Background,
}

impl Clip {
    /// Prepares the clip.
    ///
    /// # Errors
    /// [`SampleError::Setting`].
    pub fn new(settings: Settings) -> Result<Self, SampleError> {
        settings.check()?;
        Ok(Self {
            settings,
            timeline: Timeline::new(settings),
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
        self.timeline.target(index)
    }

    /// The share of the card's area that something in front of it covers in frame `index`, 0 to 1 (in the default
    /// scene 0 to 0.5).
    pub fn covered(&self, index: u32) -> f64 {
        self.timeline.covered(index)
    }

    /// The share of the card's area that is seen in frame `index`: in the frame, and not covered; 0 to 1.
    pub fn visible(&self, index: u32) -> f64 {
        self.timeline.visible(index)
    }

    /// Draws frame `index` (from 0).
    pub fn draw(&self, index: u32) -> RgbImage {
        draw::frame(self.settings, &self.timeline, &self.background, index)
    }
}
