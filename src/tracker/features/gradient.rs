//! Histograms of gradient directions: the direction and the strength of the gradient of each pixel of a row.

use std::ops::Range;

use crate::tracker::features::integral::DIRECTIONS;
use crate::tracker::image::frame::GrayFrame;

/// For each pixel of a row the direction of its gradient, in bins, and its strength.
#[derive(Debug, Clone, Default)]
pub(crate) struct GradientRow {
    pub bins: Vec<f32>,
    pub strengths: Vec<f32>,
    /// The row's gray values, and one more at each end.
    pub gray: Vec<f32>,
}

impl GradientRow {
    /// The gradients, by central differences, of `pixels` in row `y`, and nothing after them up to `padded` pixels. The
    /// frame's edge goes on as it is.
    #[inline(always)]
    pub fn compute(&mut self, frame: &GrayFrame, pixels: Range<usize>, y: usize, padded: usize) {
        let (width, height) = (frame.width() as usize, frame.height() as usize);
        let row = |y: usize| &frame.pixels()[y * width..][..width];
        let here = row(y);
        self.gray.clear();
        self.gray
            .push(f32::from(here[pixels.start.saturating_sub(1)]));
        self.gray
            .extend(here[pixels.clone()].iter().map(|&gray| f32::from(gray)));
        self.gray.push(f32::from(here[pixels.end.min(width - 1)]));

        let count = pixels.len();
        self.bins.resize(count, 0.0);
        self.strengths.resize(count, 0.0);
        let above = &row(y.saturating_sub(1))[pixels.clone()];
        let below = &row((y + 1).min(height - 1))[pixels];
        let out = self.bins.iter_mut().zip(&mut self.strengths);
        let across = self.gray[2..].iter().zip(&self.gray);
        let down = below.iter().zip(above);
        for (((right, left), (&below, &above)), (bin, strength)) in across.zip(down).zip(out) {
            let across = right - left;
            let down = f32::from(below) - f32::from(above);
            *bin = angle(across, down) * (DIRECTIONS as f32 / std::f32::consts::PI);
            *strength = (across * across + down * down).sqrt();
        }
        self.bins.resize(padded, 0.0);
        self.strengths.resize(padded, 0.0);
        self.gray.truncate(count + 1);
        self.gray.resize(padded + 1, 0.0);
    }
}

/// The unsigned angle of (x, y), from 0 to π, to 0.0003: a polynomial that vectorises (minimax fit of the arc tangent
/// on \[0, 1\]), several times as fast as `atan2`.
#[inline(always)]
fn angle(x: f32, y: f32) -> f32 {
    let (across, down) = (x.abs(), y.abs());
    let (lesser, greater) = if down > across {
        (across, down)
    } else {
        (down, across)
    };
    let greater = if greater > 1e-9 { greater } else { 1e-9 };
    let ratio = lesser / greater;
    let square = ratio * ratio;
    let octant =
        ((-0.046_496_475 * square + 0.159_314_22) * square - 0.327_622_76) * square * ratio + ratio;
    let quadrant = if down > across {
        std::f32::consts::FRAC_PI_2 - octant
    } else {
        octant
    };
    if (x < 0.0) != (y < 0.0) {
        std::f32::consts::PI - quadrant
    } else {
        quadrant
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_atan2() {
        for step in 0..2000 {
            let orientation = f64::from(step) * std::f64::consts::TAU / 2000.0;
            let (x, y) = (
                (orientation.cos() * 200.0) as f32,
                (orientation.sin() * 200.0) as f32,
            );
            let expected = f64::from(y)
                .atan2(f64::from(x))
                .rem_euclid(std::f64::consts::PI);
            let difference = (f64::from(angle(x, y)) - expected).abs();
            let difference = difference.min(std::f64::consts::PI - difference);
            assert!(difference < 3e-4, "{x}, {y}: {difference}");
        }
    }
}
