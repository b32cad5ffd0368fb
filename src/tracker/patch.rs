//! From a candidate area to its feature vector: the one place that knows what the tracker looks at.
//!
//! The area is resized to H₁ x H₂ by bilinear interpolation at the centres of its cells and taken row by row, as
//! gray values in [0, 1] (section III-B). Outside the frame the nearest edge pixel counts.

use super::{GrayFrame, Params, Rect};

/// Cuts patches out of frames; keeps its buffers from one patch to the next.
///
/// This takes as long as everything else that a step does, so each loop is one that the compiler can turn into vector
/// instructions: two rows blended into a line, neighbours gathered from the line, neighbours blended.
#[derive(Debug, Clone, Default)]
pub(super) struct PatchCutter {
    /// For each column, where the left neighbour is in the line, and the share of the right one.
    at: Vec<usize>,
    shares: Vec<f32>,
    /// The source pixels of one row of cells, in [0, 255].
    line: Vec<f32>,
    left: Vec<f32>,
    right: Vec<f32>,
}

/// Two neighbouring pixels, `first` and the one after it, and the share of the second.
#[derive(Debug, Clone, Copy)]
struct Sample {
    first: usize,
    share: f32,
}

impl PatchCutter {
    /// Writes the feature vector of `area` (working pixels, finite, sides above 0) to `out`, of length D. The
    /// values are exact in single precision.
    pub fn cut(&mut self, image: &GrayFrame, area: &Rect, params: &Params, out: &mut [f64]) {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let (columns, rows) = (params.patch_width, params.patch_height);
        let (from, until) = self.lay_columns(area, columns, width);
        for (i, target) in (0..rows).zip(out.chunks_exact_mut(columns as usize)) {
            let row = sample(area.y, area.height, i, rows, height);
            let below = (row.first + 1).min(height - 1);
            let pixels = image.pixels();
            let upper = &pixels[row.first * width + from..row.first * width + until];
            let lower = &pixels[below * width + from..below * width + until];
            for ((value, &a), &b) in self.line.iter_mut().zip(upper).zip(lower) {
                let (a, b) = (f32::from(a), f32::from(b));
                *value = a + (b - a) * row.share;
            }
            if from + self.line.len() > until {
                self.line[until - from] = self.line[until - from - 1];
            }
            let neighbours = self.left.iter_mut().zip(&mut self.right);
            let line = self.line.as_slice();
            for ((left, right), &at) in neighbours.zip(&self.at) {
                let pair = &line[at..at + 2];
                (*left, *right) = (pair[0], pair[1]);
            }
            let neighbours = self.left.iter_mut().zip(&self.right);
            for ((left, &right), &share) in neighbours.zip(&self.shares) {
                let gray = (*left + (right - *left) * share) * (1.0 / 255.0);
                // Not f32::min, which takes four instructions for the sake of NaN.
                *left = if gray < 1.0 { gray } else { 1.0 };
            }
            for (value, &gray) in target.iter_mut().zip(&self.left) {
                *value = f64::from(gray);
            }
        }
    }

    /// Lays out the columns of `area`; returns the range of source columns that they need.
    fn lay_columns(&mut self, area: &Rect, columns: u32, width: usize) -> (usize, usize) {
        let count = columns as usize;
        self.left.resize(count, 0.0);
        self.right.resize(count, 0.0);
        self.at.clear();
        self.shares.clear();
        let from = sample(area.x, area.width, 0, columns, width).first;
        for i in 0..columns {
            let sample = sample(area.x, area.width, i, columns, width);
            self.at.push(sample.first - from);
            self.shares.push(sample.share);
        }
        let len = self.at[count - 1] + 2;
        self.line.resize(len, 0.0);
        // The second of the last two; at the right edge it is the edge pixel again.
        (from, (from + len).min(width))
    }
}

/// Where the centre of cell `index` of `count` over `[start, start + extent)` lies among `pixels` pixels, whose
/// own centres are at a half.
fn sample(start: f64, extent: f64, index: u32, count: u32, pixels: usize) -> Sample {
    let center = start + extent * (f64::from(index) + 0.5) / f64::from(count) - 0.5;
    let clamped = center.clamp(0.0, (pixels - 1) as f64);
    let first = clamped as u32;
    Sample {
        first: first as usize,
        share: (clamped - f64::from(first)) as f32,
    }
}

/// The feature vector of `area` of `image`, both in working pixels: D gray values in [0, 1], row by row.
pub fn patch(image: &GrayFrame, area: &Rect, params: &Params) -> Vec<f32> {
    let mut values = vec![0.0; params.feature_len()];
    PatchCutter::default().cut(image, area, params, &mut values);
    values.into_iter().map(|value| value as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::Preset;

    fn image(width: u32, height: u32) -> GrayFrame {
        let luma = (0..width * height).map(|i| (i * 97 % 256) as u8).collect();
        GrayFrame::from_luma(width, height, luma).expect("a frame of this size")
    }

    /// Bilinear interpolation at one point, pixel by pixel.
    fn at(image: &GrayFrame, x: f64, y: f64) -> f64 {
        let pixel = |x: f64, y: f64| {
            let x = x.clamp(0.0, f64::from(image.width() - 1)) as usize;
            let y = y.clamp(0.0, f64::from(image.height() - 1)) as usize;
            f64::from(image.pixels()[y * image.width() as usize + x])
        };
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (right_share, lower_share) = (x - left, y - top);
        let row = |y| pixel(left, y) * (1.0 - right_share) + pixel(left + 1.0, y) * right_share;
        (row(top) * (1.0 - lower_share) + row(top + 1.0) * lower_share) / 255.0
    }

    #[test]
    fn every_cell_is_interpolated_at_its_centre() {
        let params = Params {
            patch_width: 7,
            patch_height: 5,
            ..Preset::Paper.params()
        };
        for (width, height) in [(40, 30), (1, 30), (40, 1), (1, 1)] {
            let image = image(width, height);
            for area in [
                Rect::new(5.0, 6.0, 7.0, 5.0),
                Rect::new(5.3, 6.8, 21.7, 3.9),
                Rect::new(-8.0, -3.5, 20.0, 14.0),
                Rect::new(36.0, 25.0, 30.0, 30.0),
                Rect::new(-200.0, 300.0, 10.0, 10.0),
            ] {
                let patch = patch(&image, &area, &params);
                for (i, &value) in patch.iter().enumerate() {
                    let x = area.x + area.width * ((i % 7) as f64 + 0.5) / 7.0;
                    let y = area.y + area.height * ((i / 7) as f64 + 0.5) / 5.0;
                    let expected = at(&image, x, y);
                    assert!((f64::from(value) - expected).abs() < 1e-5, "{area:?}, {i}");
                    assert!((0.0..=1.0).contains(&value));
                }
            }
        }
    }
}
