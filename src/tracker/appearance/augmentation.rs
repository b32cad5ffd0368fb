//! Augmentation of the first box's image: copies rotated by some degrees either way.
//!
//! A subspace of one vector is a point. With two rotated copies the first subspace spans what the target looks like
//! when it tilts, from the first frame on. The whole frame is rotated, so the rim shows what would be there.

use crate::tracker::image::frame::Frame;
use crate::tracker::image::rect::Rect;
use crate::tracker::image::warp::Rotation;
use crate::tracker::motion::particles::Particle;
use crate::tracker::params::table::Params;

/// Rotated copies at most.
pub(crate) const MAX_VIEWS: usize = 2;

/// The angles of the copies, in radians; none where that is off.
pub(crate) fn angles(params: &Params) -> impl Iterator<Item = f64> + use<> {
    let angle = params.augmentation_angle.to_radians();
    [angle, -angle].into_iter().filter(|angle| *angle != 0.0)
}

/// `frame` rotated by `angle` about the centre of `target`.
pub(crate) fn rotated(frame: &Frame, target: &Particle, angle: f64) -> Frame {
    let everywhere = Rect::new(
        0.0,
        0.0,
        frame.downsample() * f64::from(frame.width()),
        frame.downsample() * f64::from(frame.height()),
    );
    Rotation::about((target.x, target.y), angle).apply(frame, &everywhere, Frame::default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::params::presets::Preset;

    fn frame(gray: impl Fn(usize, usize) -> u8) -> Frame {
        let pixels = (0..80 * 60).map(|i| gray(i % 80, i / 80)).collect();
        Frame::from_luma(80, 60, pixels).expect("a frame of this size")
    }

    const TARGET: Particle = Particle {
        x: 40.0,
        y: 30.0,
        scale: 1.0,
    };

    #[test]
    fn a_quarter_turn_takes_rows_to_columns_and_none_leaves_all() {
        let original = frame(|x, y| ((x * 7 + y * y * 3) % 251) as u8);
        assert_eq!(rotated(&original, &TARGET, 0.0), original);
        let orientation = rotated(&original, &TARGET, std::f64::consts::FRAC_PI_2);
        for (x, y) in [(40, 30), (20, 10), (59, 49), (39, 29)] {
            // About the point between the pixels 39 and 40 and the rows 29 and 30.
            let (from_x, from_y) = (69 - y, x - 10);
            let expected = original.pixels()[from_y * 80 + from_x];
            assert_eq!(orientation.pixels()[y * 80 + x], expected, "{x} {y}");
        }
    }

    #[test]
    fn a_turned_slope_is_the_slope_along_the_turned_axis() {
        let original = frame(|x, y| (x + 2 * y) as u8);
        let angle = 10_f64.to_radians();
        let orientation = rotated(&original, &TARGET, angle);
        for (x, y) in [(30, 20), (40, 30), (50, 35)] {
            let (across, down) = (x as f64 + 0.5 - 40.0, y as f64 + 0.5 - 30.0);
            let from_x = 40.0 + angle.cos() * across - angle.sin() * down - 0.5;
            let from_y = 30.0 + angle.sin() * across + angle.cos() * down - 0.5;
            let expected = from_x + 2.0 * from_y;
            let found = f64::from(orientation.pixels()[y * 80 + x]);
            assert!((found - expected).abs() <= 0.51, "{found} {expected}");
        }
    }

    #[test]
    fn there_are_two_poses_or_none() {
        assert_eq!(angles(&Preset::Paper.params()).count(), 0);
        let found: Vec<f64> = angles(&Preset::Robust.params()).collect();
        assert_eq!(found.len(), MAX_VIEWS);
        assert_eq!(found[0], -found[1]);
    }
}
