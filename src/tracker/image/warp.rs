//! A frame rotated about a point, by bilinear interpolation.

use std::ops::Range;

use crate::tracker::image::frame::Frame;
use crate::tracker::image::plane::Plane;
use crate::tracker::image::rect::Rect;

/// `frame` rotated by `angle` radians about `center`, within `window` (both in working pixels) and a pixel around it;
/// what is further out means nothing. Beyond the edge of the frame the edge's pixel counts. What stands rotated by
/// `angle`, clockwise on the screen, is upright in the result.
pub(crate) fn rotated(frame: &Frame, center: (f64, f64), angle: f64, window: &Rect) -> Frame {
    let (sin, cos) = angle.sin_cos();
    frame.map_planes(Frame::default(), |plane, mut pixels| {
        pixels.resize(plane.pixels.len(), 0);
        let side = f64::from(plane.pixel_side);
        let (center_x, center_y) = (center.0 / side, center.1 / side);
        let window = window.in_pixels_of(side);
        for row in covered(window.y, window.height, plane.height) {
            for column in covered(window.x, window.width, plane.width) {
                // A pixel's centre is half a pixel from its edge.
                let (x, y) = (column as f64 + 0.5 - center_x, row as f64 + 0.5 - center_y);
                let (from_x, from_y) = (cos * x - sin * y, sin * x + cos * y);
                let value = interpolated(plane, center_x + from_x - 0.5, center_y + from_y - 0.5);
                pixels[row * plane.width as usize + column] = value;
            }
        }
        Plane::new(plane.size(), pixels, plane.pixel_side)
    })
}

/// The pixels of `count` that an interval touches, and one more on either side, from which gradients are taken.
fn covered(start: f64, len: f64, count: u32) -> Range<usize> {
    let clamp = |at: f64| at.clamp(0.0, f64::from(count)) as usize;
    clamp(start.floor() - 1.0)..clamp((start + len).ceil() + 1.0)
}

/// The value at (`x`, `y`); 0 is the centre of the first pixel.
fn interpolated(plane: &Plane, x: f64, y: f64) -> u8 {
    let (last_column, last_row) = (plane.width as usize - 1, plane.height as usize - 1);
    let x = x.clamp(0.0, last_column as f64);
    let y = y.clamp(0.0, last_row as f64);
    let (left, above) = (x as usize, y as usize);
    let at = |column: usize, row: usize| {
        f64::from(plane.pixels[row.min(last_row) * plane.width as usize + column.min(last_column)])
    };
    let line = |row: usize| at(left, row) + x.fract() * (at(left + 1, row) - at(left, row));
    (line(above) + y.fract() * (line(above + 1) - line(above))).round() as u8
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

    #[test]
    fn a_quarter_turn_takes_rows_to_columns_and_none_leaves_all() {
        let original = frame(|x, y| ((x * 7 + y * y * 3) % 251) as u8);
        assert_eq!(rotated(&original, CENTER, 0.0, &everywhere()), original);
        let turned = rotated(
            &original,
            CENTER,
            std::f64::consts::FRAC_PI_2,
            &everywhere(),
        );
        for (x, y) in [(40, 30), (20, 10), (59, 49), (39, 29)] {
            // About the point between the pixels 39 and 40 and the rows 29 and 30.
            let (from_x, from_y) = (69 - y, x - 10);
            let expected = original.pixels()[from_y * 80 + from_x];
            assert_eq!(turned.pixels()[y * 80 + x], expected, "{x} {y}");
        }
    }

    #[test]
    fn a_rotated_slope_is_the_slope_along_the_rotated_axis() {
        let original = frame(|x, y| (x + 2 * y) as u8);
        for angle in [0.17_f64, -0.4] {
            let turned = rotated(&original, CENTER, angle, &everywhere());
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
        let turned = rotated(&original, (0.0, 30.0), std::f64::consts::PI, &everywhere());
        assert!(turned.pixels().iter().all(|&pixel| pixel == 200));
    }

    #[test]
    fn a_window_and_a_pixel_around_it_are_those_of_the_whole_image() {
        let original = frame(|x, y| ((x * 7 + y * 3) % 251) as u8);
        let window = Rect::new(30.0, 20.0, 20.0, 15.0);
        let part = rotated(&original, CENTER, 0.5, &window);
        let whole = rotated(&original, CENTER, 0.5, &everywhere());
        for (i, pixel) in part.pixels().iter().enumerate() {
            if (29..51).contains(&(i % 80)) && (19..36).contains(&(i / 80)) {
                assert_eq!(*pixel, whole.pixels()[i], "{i}");
            }
        }
        let beyond = Rect::new(200.0, -90.0, 20.0, 15.0);
        rotated(&original, CENTER, 0.5, &beyond);
    }

    /// Chroma has pixels twice as large, about the same point.
    #[test]
    fn chroma_is_rotated_as_luma_is() {
        let rgb = |i: usize| {
            let is_red = (i % 80).abs_diff(60) < 6 && (i / 80).abs_diff(20) < 6;
            if is_red { [250, 0, 0] } else { [90; 3] }
        };
        let rgb: Vec<u8> = (0..80 * 60).flat_map(rgb).collect();
        let original = Frame::from_rgb(80, 60, &rgb).expect("a frame of this size");
        let turned = rotated(&original, CENTER, 1.1, &everywhere());
        let (mut found, mut sum) = ((0.0, 0.0), 0.0);
        let [_, cr] = turned.chroma().expect("it has colour");
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
    fn frames_of_one_row_or_column_are_rotated_too() {
        for (width, height) in [(1, 5), (5, 1), (1, 1)] {
            let pixels = (0..width * height).map(|i| i as u8).collect();
            let frame = Frame::from_luma(width, height, pixels).expect("of this size");
            let window = Rect::new(-5.0, -5.0, 20.0, 20.0);
            let turned = rotated(&frame, (40.0, 30.0), 1.0, &window);
            assert_eq!(turned.pixels().len(), frame.pixels().len());
        }
    }
}
