//! Boxes: axis-parallel, in floating-point pixels, possibly reaching over the edge of the frame.

use serde::{Deserialize, Serialize};

/// A box: top-left corner and size in pixels. May reach over the edge of the frame.
///
/// Pixel `(0, 0)` covers the square from `(0.0, 0.0)` to `(1.0, 1.0)`. Annotations that count pixels from 1,
/// as those of the OTB benchmark do, need 1 subtracted from `x` and `y`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rect {
    /// Left edge.
    pub x: f64,
    /// Top edge.
    pub y: f64,
    /// Width, above 0.
    pub width: f64,
    /// Height, above 0.
    pub height: f64,
}

impl Rect {
    /// A box from its top-left corner and size, in pixels. Nothing is checked.
    pub fn new(x: f64, y: f64, width: f64, height: f64) -> Self {
        Self {
            x,
            y,
            width,
            height,
        }
    }

    /// A box around the point `(x, y)`, in pixels. Nothing is checked.
    pub fn centered(x: f64, y: f64, width: f64, height: f64) -> Self {
        Self::new(x - width / 2.0, y - height / 2.0, width, height)
    }

    /// The same box in pixels that are `downsample` times as large.
    pub(crate) fn in_pixels_of(&self, downsample: f64) -> Self {
        self.scaled(1.0 / downsample, 1.0 / downsample)
    }

    /// The centre `(x, y)`, in pixels.
    pub fn center(&self) -> (f64, f64) {
        (self.x + self.width / 2.0, self.y + self.height / 2.0)
    }

    /// The area in square pixels; 0 for a box without extent.
    pub fn area(&self) -> f64 {
        self.width.max(0.0) * self.height.max(0.0)
    }

    /// The part that both boxes cover; without width or height where there is none.
    pub fn intersection(&self, other: &Self) -> Self {
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        let width = (self.x + self.width).min(other.x + other.width) - x;
        let height = (self.y + self.height).min(other.y + other.height) - y;
        Self::new(x, y, width.max(0.0), height.max(0.0))
    }

    /// Intersection over union, in [0, 1]; 0 if either box has no area.
    pub fn overlap(&self, other: &Self) -> f64 {
        let shared = self.intersection(other).area();
        let union = self.area() + other.area() - shared;
        if shared > 0.0 && union > 0.0 {
            (shared / union).min(1.0)
        } else {
            0.0
        }
    }

    /// The distance between the two centres, in pixels.
    pub fn center_distance(&self, other: &Self) -> f64 {
        let (x, y) = self.center();
        let (other_x, other_y) = other.center();
        (x - other_x).hypot(y - other_y)
    }

    /// The same box with x multiplied by `horizontal` and y by `vertical`.
    pub fn scaled(&self, horizontal: f64, vertical: f64) -> Self {
        Self::new(
            self.x * horizontal,
            self.y * vertical,
            self.width * horizontal,
            self.height * vertical,
        )
    }

    /// Whether all four numbers are finite and both sides are above 0.
    pub fn is_valid(&self) -> bool {
        [self.x, self.y, self.width, self.height]
            .iter()
            .all(|value| value.is_finite())
            && self.width > 0.0
            && self.height > 0.0
    }
}
