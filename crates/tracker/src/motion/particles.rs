//! A particle, and where particles may be.
//!
//! A random walk knows no limits, so every particle is clamped: its box touches the frame by a pixel, and its scale
//! stays within [`StateBounds::scales`].

use serde::{Deserialize, Serialize};

use crate::image::rect::Rect;

/// One hypothesis z = (x, y, s): the centre in working pixels, and the scale against the reference box.
///
/// The paper's state is the top-left corner; the centre stays where it is when the target changes its size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Particle {
    /// Centre along x, in working pixels.
    pub x: f64,
    /// Centre along y, in working pixels.
    pub y: f64,
    /// Scale; the reference box has 1.
    pub scale: f64,
}

/// The bounds of particles: the working image, and the reference box whose aspect every particle keeps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct StateBounds {
    /// Width of the working image.
    pub frame_width: f64,
    /// Height of the working image.
    pub frame_height: f64,
    /// Width of the box at scale 1, in working pixels.
    pub box_width: f64,
    /// Height of the box at scale 1, in working pixels.
    pub box_height: f64,
}

impl StateBounds {
    /// The minimum and the maximum scale: within 1/10 and 10, the shorter side of the box not below one working
    /// pixel, the longer not above four times that of the frame. Always contains 1.
    pub fn scales(&self) -> (f64, f64) {
        let shorter = self.box_width.min(self.box_height);
        let longer = self.box_width.max(self.box_height);
        let frame = self.frame_width.max(self.frame_height);
        let min = (1.0 / shorter).clamp(0.1, 1.0);
        let max = (4.0 * frame / longer).clamp(1.0, 10.0);
        (min, max)
    }

    /// The nearest particle that is allowed.
    pub fn clamp(&self, particle: Particle) -> Particle {
        let (min, max) = self.scales();
        let scale = particle.scale.clamp(min, max);
        let overhang = |side: f64| (side * scale / 2.0 - 1.0).max(0.0);
        let (left, up) = (overhang(self.box_width), overhang(self.box_height));
        Particle {
            x: particle.x.clamp(-left, self.frame_width + left),
            y: particle.y.clamp(-up, self.frame_height + up),
            scale,
        }
    }

    /// √(width · height) of the box of `particle`, in working pixels.
    pub fn side(&self, particle: &Particle) -> f64 {
        (self.box_width * self.box_height).sqrt() * particle.scale
    }

    /// The candidate area of `particle`, in working pixels.
    pub fn area(&self, particle: &Particle) -> Rect {
        Rect::centered(
            particle.x,
            particle.y,
            self.box_width * particle.scale,
            self.box_height * particle.scale,
        )
    }
}
