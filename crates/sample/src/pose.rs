//! How a card lies in the frame.

use bagtrack_tracker::Rect;

/// A card: a rectangle turned around its centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pose {
    /// The centre, in pixels from the top-left corner of the frame.
    pub(super) center: (f64, f64),
    /// Width and height, in pixels.
    pub(super) size: (f64, f64),
    /// Radians, clockwise as seen.
    pub(super) angle: f64,
}

impl Pose {
    pub(super) fn of(area: Rect) -> Self {
        Self {
            center: (area.x + area.width / 2.0, area.y + area.height / 2.0),
            size: (area.width, area.height),
            angle: 0.0,
        }
    }

    /// The upright rectangle around it.
    pub(super) fn bounds(&self) -> Rect {
        let (sine, cosine) = (self.angle.sin().abs(), self.angle.cos().abs());
        let (width, height) = self.size;
        let (x, y) = self.center;
        Rect::centered(
            x,
            y,
            width * cosine + height * sine,
            width * sine + height * cosine,
        )
    }

    /// Where a point of the frame is on the card, each coordinate 0 to 1; none beside the card.
    pub(super) fn on_card(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let (sine, cosine) = self.angle.sin_cos();
        let (right, down) = (x - self.center.0, y - self.center.1);
        let u = (right * cosine + down * sine) / self.size.0 + 0.5;
        let v = (down * cosine - right * sine) / self.size.1 + 0.5;
        ((0.0..1.0).contains(&u) && (0.0..1.0).contains(&v)).then_some((u, v))
    }

    /// The pose at `share` (0 to 1) of the way from this pose to `other`.
    pub(super) fn towards(&self, other: &Self, share: f64) -> Self {
        let between = |from: f64, to: f64| from + (to - from) * share;
        let both =
            |from: (f64, f64), to: (f64, f64)| (between(from.0, to.0), between(from.1, to.1));
        Self {
            center: both(self.center, other.center),
            size: both(self.size, other.size),
            angle: between(self.angle, other.angle),
        }
    }
}
