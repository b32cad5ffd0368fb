//! (C) How the look that the user pointed at would look if the target tilted a little.
//!
//! A subspace of one vector knows one look. Turned by some degrees either way in the picture, the same look makes the first
//! subspace one of three vectors: what a target does by tilting its head is in it from the first frame on, and is
//! farther from no other look. The whole frame is turned, so the rim shows what would be there.

use super::motion::Particle;
use super::{GrayFrame, Params};

/// Most poses beside the look as it is.
pub(super) const MOST: usize = 2;

/// By which angles, in radians, the look is turned; none where that is off.
pub(super) fn angles(params: &Params) -> impl Iterator<Item = f64> + use<> {
    let angle = params.pose_angle.to_radians();
    [angle, -angle].into_iter().filter(|angle| *angle != 0.0)
}

/// `frame` turned by `angle` around the centre of `target`, pixels between pixels by bilinear interpolation; beyond the
/// edge is what is at the edge.
pub(super) fn turned(frame: &GrayFrame, target: &Particle, angle: f64) -> GrayFrame {
    let (width, height) = (frame.width() as usize, frame.height() as usize);
    let (sin, cos) = angle.sin_cos();
    // A pixel's centre is half a pixel from its edge.
    let gray = |x: f64, y: f64| {
        let x = (x - 0.5).clamp(0.0, (width - 1) as f64);
        let y = (y - 0.5).clamp(0.0, (height - 1) as f64);
        let (left, up) = (x as usize, y as usize);
        let (right, down) = ((left + 1).min(width - 1), (up + 1).min(height - 1));
        let (across, along) = (x.fract(), y.fract());
        let at = |column: usize, row: usize| f64::from(frame.pixels()[row * width + column]);
        let upper = at(left, up) + across * (at(right, up) - at(left, up));
        let lower = at(left, down) + across * (at(right, down) - at(left, down));
        (upper + along * (lower - upper)).round() as u8
    };
    let mut pixels = Vec::with_capacity(width * height);
    for row in 0..height {
        let y = row as f64 + 0.5 - target.y;
        pixels.extend((0..width).map(|column| {
            let x = column as f64 + 0.5 - target.x;
            gray(target.x + cos * x - sin * y, target.y + sin * x + cos * y)
        }));
    }
    GrayFrame::from_luma(frame.width(), frame.height(), pixels)
        .expect("as many pixels as the frame has")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::Preset;

    fn frame(gray: impl Fn(usize, usize) -> u8) -> GrayFrame {
        let pixels = (0..80 * 60).map(|i| gray(i % 80, i / 80)).collect();
        GrayFrame::from_luma(80, 60, pixels).expect("a frame of this size")
    }

    const TARGET: Particle = Particle {
        x: 40.0,
        y: 30.0,
        scale: 1.0,
    };

    #[test]
    fn a_quarter_turn_takes_rows_to_columns_and_none_leaves_all() {
        let original = frame(|x, y| ((x * 7 + y * y * 3) % 251) as u8);
        assert_eq!(turned(&original, &TARGET, 0.0), original);
        let turn = turned(&original, &TARGET, std::f64::consts::FRAC_PI_2);
        for (x, y) in [(40, 30), (20, 10), (59, 49), (39, 29)] {
            // About the point between the pixels 39 and 40 and the rows 29 and 30.
            let (from_x, from_y) = (69 - y, x - 10);
            let expected = original.pixels()[from_y * 80 + from_x];
            assert_eq!(turn.pixels()[y * 80 + x], expected, "{x} {y}");
        }
    }

    #[test]
    fn a_turned_slope_is_the_slope_along_the_turned_axis() {
        let original = frame(|x, y| (x + 2 * y) as u8);
        let angle = 10_f64.to_radians();
        let turn = turned(&original, &TARGET, angle);
        for (x, y) in [(30, 20), (40, 30), (50, 35)] {
            let (across, down) = (x as f64 + 0.5 - 40.0, y as f64 + 0.5 - 30.0);
            let from_x = 40.0 + angle.cos() * across - angle.sin() * down - 0.5;
            let from_y = 30.0 + angle.sin() * across + angle.cos() * down - 0.5;
            let expected = from_x + 2.0 * from_y;
            let found = f64::from(turn.pixels()[y * 80 + x]);
            assert!((found - expected).abs() <= 0.51, "{found} {expected}");
        }
    }

    #[test]
    fn there_are_two_poses_or_none() {
        assert_eq!(angles(&Preset::Paper.params()).count(), 0);
        let found: Vec<f64> = angles(&Preset::Robust.params()).collect();
        assert_eq!(found.len(), MOST);
        assert_eq!(found[0], -found[1]);
    }
}
