//! A frame rotated about a point: where points are before and after, and what the rotated image shows.

use std::ops::Range;

use pulp::{Arch, Simd};

use crate::tracker::image::bilinear::{self, Axis};
use crate::tracker::image::frame::Frame;
use crate::tracker::image::plane::Plane;
use crate::tracker::image::rect::Rect;

/// A rotation about a point. It makes the *rotated* image of the *original* one: a target that stands rotated by this
/// angle in the original is upright in the rotated image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rotation {
    x: f64,
    y: f64,
    sin: f64,
    cos: f64,
}

impl Rotation {
    /// About the point (`x`, `y`), in working pixels, by `angle` radians. Positive angles are clockwise on the screen,
    /// since y points down.
    pub fn about((x, y): (f64, f64), angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        Self { x, y, sin, cos }
    }

    /// The point of the original that is at (`x`, `y`) in the rotated image.
    #[inline(always)]
    pub fn to_original(self, (x, y): (f64, f64)) -> (f64, f64) {
        let (x, y) = (x - self.x, y - self.y);
        (
            self.x + self.cos * x - self.sin * y,
            self.y + self.sin * x + self.cos * y,
        )
    }

    /// The displacement in the rotated image of one in the original.
    pub fn rotated_displacement(self, (x, y): (f64, f64)) -> (f64, f64) {
        (self.cos * x + self.sin * y, self.cos * y - self.sin * x)
    }

    /// `frame` rotated within `window` (working pixels of the rotated image) and a pixel around it; what is further out
    /// means nothing. Values are interpolated bilinearly; beyond the edge the edge's pixel counts. A plane one pixel wide
    /// or high stays as it is. The memory of `scratch` is used again, whatever it holds.
    pub fn apply(&self, frame: &Frame, window: &Rect, scratch: Frame) -> Frame {
        frame.map_planes(scratch, |plane, mut pixels| {
            pixels.resize(plane.pixels.len(), 0);
            if plane.width > 1 && plane.height > 1 {
                let side = f64::from(plane.pixel_side);
                let window = window.in_pixels_of(side);
                let columns = covered(window.x, window.width, plane.width);
                let rows = covered(window.y, window.height, plane.height);
                let (x, y) = (self.x / side, self.y / side);
                rotate(Self { x, y, ..*self }, plane, columns, rows, &mut pixels);
            } else {
                pixels.copy_from_slice(&plane.pixels);
            }
            Plane::new(plane.size(), pixels, plane.pixel_side)
        })
    }
}

/// The pixels of `count` that an interval touches, and one more on either side, from which gradients are taken.
fn covered(start: f64, len: f64, count: u32) -> Range<usize> {
    let clamp = |at: f64| at.clamp(0.0, f64::from(count)) as usize;
    clamp(start.floor() - 1.0)..clamp((start + len).ceil() + 1.0)
}

/// Replaces the pixels of `columns` and `rows` in `out` by those of the rotated image.
#[pulp::with_simd(rotate = Arch::new())]
#[inline(always)]
fn rotate_simd<S: Simd>(
    _: S,
    rotation: Rotation,
    plane: &Plane,
    columns: Range<usize>,
    rows: Range<usize>,
    out: &mut [u8],
) {
    let width = plane.width as usize;
    for row in rows {
        // A pixel's centre is half a pixel from its edge.
        let first = (columns.start as f64 + 0.5, row as f64 + 0.5);
        let (x, y) = rotation.to_original(first);
        let x = Axis::new(x - 0.5, rotation.cos, plane.width);
        let y = Axis::new(y - 0.5, rotation.sin, plane.height);
        bilinear::sample_row(plane, &x, &y, &mut out[row * width..][columns.clone()]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CENTER: (f64, f64) = (40.0, 30.0);

    fn frame(gray: impl Fn(usize, usize) -> u8) -> Frame {
        let pixels = (0..80 * 60).map(|i| gray(i % 80, i / 80)).collect();
        Frame::from_luma(80, 60, pixels).expect("a frame of this size")
    }

    fn everywhere() -> Rect {
        Rect::new(0.0, 0.0, 80.0, 60.0)
    }

    /// In floating point, a pixel at a time.
    fn textbook(frame: &Frame, angle: f64) -> Vec<f64> {
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
        let point = |i: usize| ((i % 80) as f64 + 0.5 - 40.0, (i / 80) as f64 + 0.5 - 30.0);
        (0..80 * 60)
            .map(point)
            .map(|(x, y)| at(40.0 + cos * x - sin * y, 30.0 + sin * x + cos * y))
            .collect()
    }

    #[test]
    fn a_rotated_image_is_that_of_the_textbook() {
        let original = frame(|x, y| ((x * x / 3 + y * 5) % 200) as u8);
        for angle in [0.0_f64, 0.3, -1.2, 3.0] {
            let rotated = Rotation::about(CENTER, angle);
            let rotated = rotated.apply(&original, &everywhere(), Frame::default());
            for (found, expected) in rotated.pixels().iter().zip(textbook(&original, angle)) {
                let off = (f64::from(*found) - expected).abs();
                // Weights are multiples of 1/256 along both axes, and neighbours differ by up to 200.
                assert!(off <= 2.1, "{angle}: {found} {expected}");
            }
        }
        let still = Rotation::about(CENTER, 0.0);
        let still = still.apply(&original, &everywhere(), Frame::default());
        assert_eq!(still.pixels()[..79], original.pixels()[..79]);
    }

    #[test]
    fn a_window_and_a_pixel_around_it_are_those_of_the_whole_image() {
        let original = frame(|x, y| ((x * 7 + y * 3) % 251) as u8);
        let rotation = Rotation::about(CENTER, 0.5);
        let window = Rect::new(30.0, 20.0, 20.0, 15.0);
        let part = rotation.apply(&original, &window, Frame::default());
        let whole = rotation.apply(&original, &everywhere(), Frame::default());
        for (i, pixel) in part.pixels().iter().enumerate() {
            if (29..51).contains(&(i % 80)) && (19..36).contains(&(i / 80)) {
                assert_eq!(*pixel, whole.pixels()[i], "{i}");
            }
        }
        let beyond = Rect::new(200.0, -90.0, 20.0, 15.0);
        rotation.apply(&original, &beyond, Frame::default());
    }

    /// Chroma has pixels twice as large, about the same point.
    #[test]
    fn chroma_is_rotated_as_luma_is() {
        let red = |x: usize, y: usize| x.abs_diff(60) < 6 && y.abs_diff(20) < 6;
        let rgb = |i: usize| {
            if red(i % 80, i / 80) {
                [250, 0, 0]
            } else {
                [90; 3]
            }
        };
        let rgb: Vec<u8> = (0..80 * 60).flat_map(rgb).collect();
        let original = Frame::from_rgb(80, 60, &rgb).expect("a frame of this size");
        let rotated =
            Rotation::about(CENTER, 1.1).apply(&original, &everywhere(), Frame::default());
        let (mut found, mut sum) = ((0.0, 0.0), 0.0);
        let [_, cr] = rotated.chroma().expect("it has colour");
        for (i, &value) in cr.pixels.iter().enumerate() {
            let weight = f64::from(value) - 128.0;
            let (x, y) = (2.0 * (i % 40) as f64 + 1.0, 2.0 * (i / 40) as f64 + 1.0);
            found = (found.0 + weight * x, found.1 + weight * y);
            sum += weight;
        }
        let (x, y) = Rotation::about(CENTER, 1.1).to_original((found.0 / sum, found.1 / sum));
        assert!((x - 60.5).abs() < 0.5 && (y - 20.5).abs() < 0.5, "{x} {y}");
    }

    #[test]
    fn points_of_the_rotated_image_are_mapped_to_where_they_are_in_the_original() {
        let dot = |x: usize, y: usize| if (x, y) == (60, 20) { 255 } else { 0 };
        let original = frame(dot);
        for angle in [0.4, -0.7, 2.0] {
            let rotation = Rotation::about(CENTER, angle);
            let rotated = rotation.apply(&original, &everywhere(), Frame::default());
            let brightest = (0..80 * 60).max_by_key(|&i| rotated.pixels()[i]);
            let brightest = brightest.expect("there are pixels");
            let there = ((brightest % 80) as f64 + 0.5, (brightest / 80) as f64 + 0.5);
            let (x, y) = rotation.to_original(there);
            assert!((x - 60.5).abs() < 1.0 && (y - 20.5).abs() < 1.0);
            let shift = rotation.rotated_displacement((x - CENTER.0, y - CENTER.1));
            assert!((CENTER.0 + shift.0 - there.0).abs() < 1e-9);
            assert!((CENTER.1 + shift.1 - there.1).abs() < 1e-9);
        }
    }

    #[test]
    fn frames_of_one_row_or_column_stay() {
        for (width, height) in [(1, 5), (5, 1), (1, 1)] {
            let pixels = (0..width * height).map(|i| i as u8).collect();
            let frame = Frame::from_luma(width, height, pixels).expect("of this size");
            let window = Rect::new(-5.0, -5.0, 20.0, 20.0);
            let rotation = Rotation::about(CENTER, 1.0);
            assert_eq!(rotation.apply(&frame, &window, Frame::default()), frame);
        }
    }
}
