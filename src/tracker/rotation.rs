//! A turn of the picture around a point: where things are before and after, and what is seen then.

use super::motion::Particle;
use super::{GrayFrame, Rect};

/// Places between pixels are counted in so many parts, as a power of two, and mixed in [`SHARES`] shares.
const PARTS: u32 = 16;
const SHARES: i64 = 256;

/// A turn around a point. The picture that it makes is the *turned* one; a target that has turned by as much in the picture
/// stands upright there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rotation {
    x: f64,
    y: f64,
    sin: f64,
    cos: f64,
}

impl Rotation {
    /// Around the centre of `target`, by `angle` radians: clockwise as the picture is seen, for y points down.
    pub fn about(target: &Particle, angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        let (x, y) = (target.x, target.y);
        Self { x, y, sin, cos }
    }

    /// Where `particle` of the turned picture is in the picture itself.
    pub fn in_picture(&self, particle: &Particle) -> Particle {
        let (x, y) = (particle.x - self.x, particle.y - self.y);
        Particle {
            x: self.x + self.cos * x - self.sin * y,
            y: self.y + self.sin * x + self.cos * y,
            scale: particle.scale,
        }
    }

    /// What a displacement in the picture is in the turned one.
    pub fn turned_shift(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (self.cos * x + self.sin * y, self.cos * y - self.sin * x)
    }

    /// `frame` turned, within `window` (working pixels of the turned picture); outside of it is what was there before. Gray
    /// values between pixels by bilinear interpolation, beyond the edge what is at the edge. `room` is memory, whatever it
    /// holds.
    pub fn apply(&self, frame: &GrayFrame, window: &Rect, mut room: Vec<u8>) -> GrayFrame {
        let (width, height) = (frame.width() as usize, frame.height() as usize);
        let source = frame.pixels();
        room.clear();
        room.extend_from_slice(source);
        let span = |from: f64, length: f64, limit: usize| {
            let held = |at: f64| at.clamp(0.0, limit as f64) as usize;
            held(from.floor())..held((from + length).ceil())
        };
        let columns = span(window.x, window.width, width);
        let rows = span(window.y, window.height, height);
        // Of one row or column there is nothing to mix.
        if width > 1 && height > 1 {
            let parts = f64::from(1_u32 << PARTS);
            let part = |value: f64| (value * parts).round() as i64;
            let (step_x, step_y) = (part(self.cos), part(self.sin));
            let [last_x, last_y] = [width, height].map(|side| side as i64 - 1);
            for row in rows {
                // A pixel's centre is half a pixel from its edge.
                let (x, y) = (
                    columns.start as f64 + 0.5 - self.x,
                    row as f64 + 0.5 - self.y,
                );
                let mut from_x = part(self.x + self.cos * x - self.sin * y - 0.5);
                let mut from_y = part(self.y + self.sin * x + self.cos * y - 0.5);
                for out in &mut room[row * width..][columns.clone()] {
                    let ((x, across), (y, along)) = (place(from_x, last_x), place(from_y, last_y));
                    *out = mix(source, y * width + x, width, (across, along));
                    from_x += step_x;
                    from_y += step_y;
                }
            }
        }
        frame.with_pixels(room)
    }
}

/// The pixel before a place, which is given in parts, and the share of the one after it: there is one, for the last pixel is all of
/// the one after the last but one.
#[inline(always)]
fn place(at: i64, last: i64) -> (usize, i64) {
    let at = at.clamp(0, last << PARTS);
    let before = (at >> PARTS).min(last - 1);
    (
        before as usize,
        ((at - (before << PARTS)) * SHARES) >> PARTS,
    )
}

/// The gray value that is `across` and `along` shares from the pixel at `upper` to those right of and below it.
#[inline(always)]
fn mix(source: &[u8], upper: usize, width: usize, (across, along): (i64, i64)) -> u8 {
    let line = |at: usize| {
        let pair = &source[at..at + 2];
        i64::from(pair[0]) * (SHARES - across) + i64::from(pair[1]) * across
    };
    let mixed = line(upper) * (SHARES - along) + line(upper + width) * along;
    ((mixed + SHARES * SHARES / 2) / (SHARES * SHARES)) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    const TARGET: Particle = Particle {
        x: 40.0,
        y: 30.0,
        scale: 1.0,
    };

    fn frame(gray: impl Fn(usize, usize) -> u8) -> GrayFrame {
        let pixels = (0..80 * 60).map(|i| gray(i % 80, i / 80)).collect();
        GrayFrame::from_luma(80, 60, pixels).expect("a frame of this size")
    }

    fn everywhere() -> Rect {
        Rect::new(0.0, 0.0, 80.0, 60.0)
    }

    /// In floating point, a pixel at a time.
    fn textbook(frame: &GrayFrame, angle: f64) -> Vec<f64> {
        let (sin, cos) = angle.sin_cos();
        let at = |x: f64, y: f64| {
            let (x, y) = ((x - 0.5).clamp(0.0, 79.0), (y - 0.5).clamp(0.0, 59.0));
            let pixel = |x: f64, y: f64| {
                let (x, y) = (x.min(79.0) as usize, y.min(59.0) as usize);
                f64::from(frame.pixels()[y * 80 + x])
            };
            let (left, up) = (x.floor(), y.floor());
            let line = |y: f64| {
                let (a, b) = (pixel(left, y), pixel(left + 1.0, y));
                a + (b - a) * x.fract()
            };
            line(up) + (line(up + 1.0) - line(up)) * y.fract()
        };
        let place = |i: usize| ((i % 80) as f64 + 0.5 - 40.0, (i / 80) as f64 + 0.5 - 30.0);
        (0..80 * 60)
            .map(place)
            .map(|(x, y)| at(40.0 + cos * x - sin * y, 30.0 + sin * x + cos * y))
            .collect()
    }

    #[test]
    fn a_turned_picture_is_that_of_the_textbook() {
        let original = frame(|x, y| ((x * x / 3 + y * 5) % 200) as u8);
        for angle in [0.0_f64, 0.3, -1.2, 3.0] {
            let turned = Rotation::about(&TARGET, angle);
            let turned = turned.apply(&original, &everywhere(), vec![9; 7]);
            for (found, expected) in turned.pixels().iter().zip(textbook(&original, angle)) {
                let off = (f64::from(*found) - expected).abs();
                // Shares of a 256th, along both axes, of a step of up to 200.
                assert!(off <= 2.1, "{angle}: {found} {expected}");
            }
        }
        let still = Rotation::about(&TARGET, 0.0);
        let still = still.apply(&original, &everywhere(), Vec::new());
        assert_eq!(still.pixels()[..79], original.pixels()[..79]);
    }

    #[test]
    fn outside_the_window_nothing_changes() {
        let original = frame(|x, y| ((x * 7 + y * 3) % 251) as u8);
        let rotation = Rotation::about(&TARGET, 0.5);
        let window = Rect::new(30.0, 20.0, 20.0, 15.0);
        let part = rotation.apply(&original, &window, Vec::new());
        let whole = rotation.apply(&original, &everywhere(), Vec::new());
        for (i, pixel) in part.pixels().iter().enumerate() {
            let inside = (30..50).contains(&(i % 80)) && (20..35).contains(&(i / 80));
            let expected = if inside { &whole } else { &original };
            assert_eq!(*pixel, expected.pixels()[i], "{i}");
        }
        let beyond = Rect::new(200.0, -90.0, 20.0, 15.0);
        assert_eq!(rotation.apply(&original, &beyond, Vec::new()), original);
    }

    #[test]
    fn what_is_at_a_place_of_the_turned_picture_is_where_that_is_in_the_picture() {
        let dot = |x: usize, y: usize| if (x, y) == (60, 20) { 255 } else { 0 };
        let original = frame(dot);
        for angle in [0.4, -0.7, 2.0] {
            let rotation = Rotation::about(&TARGET, angle);
            let turned = rotation.apply(&original, &everywhere(), Vec::new());
            let brightest = (0..80 * 60).max_by_key(|&i| turned.pixels()[i]);
            let brightest = brightest.expect("there are pixels");
            let there = Particle {
                x: (brightest % 80) as f64 + 0.5,
                y: (brightest / 80) as f64 + 0.5,
                scale: 1.0,
            };
            let here = rotation.in_picture(&there);
            assert!((here.x - 60.5).abs() < 1.0 && (here.y - 20.5).abs() < 1.0);
            let shift = rotation.turned_shift((here.x - TARGET.x, here.y - TARGET.y));
            assert!((TARGET.x + shift.0 - there.x).abs() < 1e-9);
            assert!((TARGET.y + shift.1 - there.y).abs() < 1e-9);
        }
    }

    #[test]
    fn the_thinnest_pictures_stay() {
        for (width, height) in [(1, 5), (5, 1), (1, 1)] {
            let pixels = (0..width * height).map(|i| i as u8).collect();
            let frame = GrayFrame::from_luma(width, height, pixels).expect("of this size");
            let window = Rect::new(-5.0, -5.0, 20.0, 20.0);
            let rotation = Rotation::about(&TARGET, 1.0);
            assert_eq!(rotation.apply(&frame, &window, Vec::new()), frame);
        }
    }
}
