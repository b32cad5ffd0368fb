//! The gradients of a row of pixels: their directions and strengths.

use std::ops::Range;

use crate::features::hog::channels::{DIRECTIONS, HALF_CHROMA};
use crate::image::frame::Frame;
use crate::image::plane::Plane;
use crate::image::ycbcr::NEUTRAL;

/// The gradients of a row of pixels.
#[derive(Debug, Clone, Default)]
pub(crate) struct GradientRow {
    /// The unsigned direction of each pixel's gradient, in bins: 0 to [`DIRECTIONS`] for 0 to 180 degrees.
    pub bins: Vec<f32>,
    /// Half of the length of each pixel's gradient, in gray levels: 0 to 255 / √2.
    pub half_strengths: Vec<f32>,
    /// The gray values minus an offset; the first is that of the pixel left of the row.
    pub gray: Vec<f32>,
    /// Cb and Cr minus those of gray, compressed to -1 to 1: ±1/2 at [`HALF_CHROMA`].
    pub chroma: [Vec<f32>; 2],
}

impl GradientRow {
    /// Takes the chroma of `pixels` in row `y`; a row of chroma serves two rows of luma. Zeros follow up to `padded`
    /// pixels.
    #[inline(always)]
    pub fn take_chroma(&mut self, frame: &Frame, pixels: Range<usize>, y: usize, padded: usize) {
        for (channel, out) in self.chroma.iter_mut().enumerate() {
            out.clear();
            if let Some(planes) = &frame.chroma {
                compress_chroma(&planes[channel], pixels.clone(), y, out);
            }
            out.resize(padded, 0.0);
        }
    }

    /// Computes the gradients of `pixels` in row `y` by central differences, not halved. Zeros follow up to `padded`
    /// pixels. Beyond the frame's edge the edge's pixel counts. `offset` is subtracted from the gray values.
    #[inline(always)]
    pub fn compute(
        &mut self,
        frame: &Frame,
        pixels: Range<usize>,
        y: usize,
        padded: usize,
        offset: f32,
    ) {
        let (width, height) = (frame.width() as usize, frame.height() as usize);
        let row = |y: usize| &frame.pixels()[y * width..][..width];
        let line = row(y);
        let gray = |&value: &u8| f32::from(value) - offset;
        self.gray.clear();
        self.gray.push(gray(&line[pixels.start.saturating_sub(1)]));
        self.gray.extend(line[pixels.clone()].iter().map(gray));
        self.gray.push(gray(&line[pixels.end.min(width - 1)]));
        let count = pixels.len();
        self.bins.resize(count, 0.0);
        self.half_strengths.resize(count, 0.0);
        let above = &row(y.saturating_sub(1))[pixels.clone()];
        let below = &row((y + 1).min(height - 1))[pixels];
        let out = self.bins.iter_mut().zip(&mut self.half_strengths);
        let across = self.gray[2..].iter().zip(&self.gray);
        let down = below.iter().zip(above);
        for (((right, left), (&below, &above)), (bin, half_strength)) in across.zip(down).zip(out) {
            let across = right - left;
            let down = f32::from(below) - f32::from(above);
            *bin = angle(across, down) * (DIRECTIONS as f32 / std::f32::consts::PI);
            *half_strength = 0.5 * (across * across + down * down).sqrt();
        }
        self.bins.resize(padded, 0.0);
        self.half_strengths.resize(padded, 0.0);
        self.gray.truncate(count + 1);
        self.gray.resize(padded + 1, 0.0);
    }
}

/// The compressed chroma of each value of a pixel.
const COMPRESSED: [f32; 256] = {
    let mut compressed = [0.0; 256];
    let mut value = 0;
    while value < 256 {
        let chroma = value as f32 - NEUTRAL as f32;
        compressed[value] = chroma / (HALF_CHROMA + chroma.abs());
        value += 1;
    }
    compressed
};

/// Appends the compressed chroma of `pixels` in row `y` of the luma, whose pixels are half as large as those of
/// `plane`.
#[inline(always)]
fn compress_chroma(plane: &Plane, pixels: Range<usize>, y: usize, out: &mut Vec<f32>) {
    let row = plane.row(y / 2);
    let last = row.len() - 1;
    let (first, end) = (pixels.start / 2, (pixels.end - 1) / 2 + 1);
    // Of the first and the last pair only one may be wanted.
    let skipped = pixels.start % 2;
    out.resize(2 * (end - first), 0.0);
    for (pair, column) in out.as_chunks_mut().0.iter_mut().zip(first..end) {
        *pair = [COMPRESSED[usize::from(row[column.min(last)])]; 2];
    }
    out.copy_within(skipped.., 0);
    out.truncate(pixels.len());
}

/// The unsigned angle of (x, y), 0 to π, to within 0.0003: a minimax polynomial of the arc tangent on \[0, 1\]. It
/// vectorises, and is several times as fast as `atan2`.
#[inline(always)]
fn angle(x: f32, y: f32) -> f32 {
    let (across, down) = (x.abs(), y.abs());
    let (shorter, longer) = if down > across {
        (across, down)
    } else {
        (down, across)
    };
    let longer = if longer > 1e-9 { longer } else { 1e-9 };
    let ratio = shorter / longer;
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
