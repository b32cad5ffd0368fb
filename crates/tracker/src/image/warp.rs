//! A frame rotated about a point: where points are before and after, and what the rotated image shows.

use std::ops::Range;

use crate::image::frame::Frame;
use crate::image::plane::Plane;
use crate::image::rect::Rect;

/// Fractional bits of a coordinate, and of a weight: whole numbers are faster than floating-point ones here, and exact
/// enough for 8-bit pixels.
const COORDINATE_BITS: u32 = 16;
const WEIGHT_BITS: u32 = 8;

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

    /// `frame` rotated within `window` (working pixels of the rotated image) and a pixel around it, by bilinear
    /// interpolation; further out are the pixels of `frame` itself. Beyond the edge the edge's pixel counts. The memory
    /// of `scratch` is used again, and what it held is not seen.
    pub fn apply(&self, frame: &Frame, window: &Rect, scratch: Frame) -> Frame {
        frame.map_planes(scratch, |plane, mut pixels| {
            pixels.clear();
            pixels.extend_from_slice(&plane.pixels);
            self.rotate_within(window, plane, pixels)
        })
    }

    /// Like [`Self::apply`], for callers that read nothing further out: what is there is not defined.
    pub fn apply_within(&self, frame: &Frame, window: &Rect, scratch: Frame) -> Frame {
        frame.map_planes(scratch, |plane, mut pixels| {
            pixels.resize(plane.pixels.len(), 0);
            self.rotate_within(window, plane, pixels)
        })
    }

    /// Writes the rotated `plane` to `pixels`, within `window` and a pixel around it.
    fn rotate_within(&self, window: &Rect, plane: &Plane, mut pixels: Vec<u8>) -> Plane {
        let side = f64::from(plane.pixel_side);
        let window = window.in_pixels_of(side);
        let columns = covered(window.x, window.width, plane.width);
        let (x, y) = (self.x / side, self.y / side);
        let rotation = Self { x, y, ..*self };
        let (step_x, step_y) = (fixed(self.cos), fixed(self.sin));
        for row in covered(window.y, window.height, plane.height) {
            // A pixel's centre is half a pixel from its edge.
            let first = (columns.start as f64 + 0.5, row as f64 + 0.5);
            let (x, y) = rotation.to_original(first);
            let (mut x, mut y) = (fixed(x - 0.5), fixed(y - 0.5));
            for out in &mut pixels[row * plane.width as usize..][columns.clone()] {
                *out = interpolated(plane, x, y);
                (x, y) = (x + step_x, y + step_y);
            }
        }
        Plane::new(plane.size(), pixels, plane.pixel_side)
    }
}

/// The pixels of `count` that an interval touches, and one more on either side, from which gradients are taken.
fn covered(start: f64, len: f64, count: u32) -> Range<usize> {
    let clamp = |at: f64| at.clamp(0.0, f64::from(count)) as usize;
    clamp(start.floor() - 1.0)..clamp((start + len).ceil() + 1.0)
}

fn fixed(value: f64) -> i32 {
    (value * f64::from(1 << COORDINATE_BITS)).round() as i32
}

/// The value at the fixed-point coordinates (`x`, `y`); 0 is the centre of the first pixel.
#[inline(always)]
fn interpolated(plane: &Plane, x: i32, y: i32) -> u8 {
    let (width, height) = (plane.width as usize, plane.height as usize);
    let inside = |at: i32, count: usize| at.clamp(0, (count as i32 - 1) << COORDINATE_BITS);
    let whole = |at: i32| (at >> COORDINATE_BITS) as usize;
    // As an unsigned number a negative coordinate is larger than any other.
    let (column, row) = (whole(x), whole(y));
    let (x, y, square) = if column < width - 1 && row < height - 1 {
        let pixels = &plane.pixels[row * width + column..][..width + 2];
        (
            x,
            y,
            [pixels[0], pixels[1], pixels[width], pixels[width + 1]],
        )
    } else {
        let (x, y) = (inside(x, width), inside(y, height));
        let (column, row) = (whole(x), whole(y));
        let (upper, lower) = (plane.row(row), plane.row(row + 1));
        let next = (column + 1).min(width - 1);
        (
            x,
            y,
            [upper[column], upper[next], lower[column], lower[next]],
        )
    };
    let [right, down] = [x, y].map(|at| {
        let fraction = at as u32 & ((1 << COORDINATE_BITS) - 1);
        fraction >> (COORDINATE_BITS - WEIGHT_BITS)
    });
    let between = |from: u32, to: u32, share: u32| from * ((1 << WEIGHT_BITS) - share) + to * share;
    let square = square.map(u32::from);
    let upper = between(square[0], square[1], right);
    let lower = between(square[2], square[3], right);
    let sum = between(upper, lower, down);
    ((sum + (1 << (2 * WEIGHT_BITS - 1))) >> (2 * WEIGHT_BITS)) as u8
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

    fn rotated(frame: &Frame, angle: f64) -> Frame {
        Rotation::about(CENTER, angle).apply(frame, &everywhere(), Frame::default())
    }

    #[test]
    fn a_quarter_turn_takes_rows_to_columns_and_none_leaves_all() {
        let original = frame(|x, y| ((x * 7 + y * y * 3) % 251) as u8);
        assert_eq!(rotated(&original, 0.0), original);
        let turned = rotated(&original, std::f64::consts::FRAC_PI_2);
        for (x, y) in [(40, 30), (20, 10), (59, 49), (39, 29)] {
            // The turn is about the point between the columns 39 and 40 and the rows 29 and 30.
            let (from_x, from_y) = (69 - y, x - 10);
            let expected = original.pixels()[from_y * 80 + from_x];
            assert_eq!(turned.pixels()[y * 80 + x], expected, "{x} {y}");
        }
    }

    #[test]
    fn a_rotated_slope_is_the_slope_along_the_rotated_axis() {
        let original = frame(|x, y| (x + 2 * y) as u8);
        for angle in [0.17_f64, -0.4] {
            let turned = rotated(&original, angle);
            for (x, y) in [(30, 20), (40, 30), (50, 35)] {
                let (across, down) = (x as f64 + 0.5 - 40.0, y as f64 + 0.5 - 30.0);
                let from_x = 40.0 + angle.cos() * across - angle.sin() * down - 0.5;
                let from_y = 30.0 + angle.sin() * across + angle.cos() * down - 0.5;
                let expected = from_x + 2.0 * from_y;
                let found = f64::from(turned.pixels()[y * 80 + x]);
                assert!((found - expected).abs() <= 0.51, "{found} {expected}");
            }
        }
    }

    #[test]
    fn beyond_the_edge_the_edges_pixel_counts() {
        let original = frame(|x, _| if x == 0 { 200 } else { 10 });
        let turned = Rotation::about((0.0, 30.0), std::f64::consts::PI).apply(
            &original,
            &everywhere(),
            Frame::default(),
        );
        assert!(turned.pixels().iter().all(|&pixel| pixel == 200));
    }

    #[test]
    fn a_window_and_a_pixel_around_it_are_rotated_and_the_rest_is_as_it_was() {
        let original = frame(|x, y| ((x * 7 + y * 3) % 251) as u8);
        let window = Rect::new(30.0, 20.0, 20.0, 15.0);
        let used = frame(|_, _| 99);
        let part = Rotation::about(CENTER, 0.5).apply(&original, &window, used);
        let whole = rotated(&original, 0.5);
        for (i, pixel) in part.pixels().iter().enumerate() {
            if (29..51).contains(&(i % 80)) && (19..36).contains(&(i / 80)) {
                assert_eq!(*pixel, whole.pixels()[i], "{i}");
            } else {
                assert_eq!(*pixel, original.pixels()[i], "{i}");
            }
        }
        let beyond = Rect::new(200.0, -90.0, 20.0, 15.0);
        Rotation::about(CENTER, 0.5).apply(&original, &beyond, Frame::default());
    }

    /// Chroma has pixels twice as large, and is rotated about the same point.
    #[test]
    fn chroma_is_rotated_as_luma_is() {
        let rgb = |i: usize| {
            let is_red = (i % 80).abs_diff(60) < 6 && (i / 80).abs_diff(20) < 6;
            if is_red { [250, 0, 0] } else { [90; 3] }
        };
        let rgb: Vec<u8> = (0..80 * 60).flat_map(rgb).collect();
        let original = Frame::from_rgb(80, 60, &rgb).expect("a frame of this size");
        let turned = rotated(&original, 1.1);
        let (mut found, mut sum) = ((0.0, 0.0), 0.0);
        let [_, cr] = turned.chroma.as_ref().expect("it has colour");
        for (i, &value) in cr.pixels.iter().enumerate() {
            let weight = f64::from(value) - 128.0;
            let (x, y) = (2.0 * (i % 40) as f64 + 1.0, 2.0 * (i / 40) as f64 + 1.0);
            found = (found.0 + weight * x, found.1 + weight * y);
            sum += weight;
        }
        let (x, y) = (found.0 / sum - 40.0, found.1 / sum - 30.0);
        let (sin, cos) = 1.1_f64.sin_cos();
        let (x, y) = (40.0 + cos * x - sin * y, 30.0 + sin * x + cos * y);
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
    fn frames_of_one_row_or_column_are_rotated_too() {
        for (width, height) in [(1, 5), (5, 1), (1, 1)] {
            let pixels = (0..width * height).map(|i| i as u8).collect();
            let frame = Frame::from_luma(width, height, pixels).expect("of this size");
            let window = Rect::new(-5.0, -5.0, 20.0, 20.0);
            let turned = Rotation::about(CENTER, 1.0).apply(&frame, &window, Frame::default());
            assert_eq!(turned.pixels().len(), frame.pixels().len());
        }
    }
}
