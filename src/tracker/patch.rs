//! From a candidate area to its feature vector: the one place that knows what the tracker looks at.
//!
//! The area is resized to H₁ x H₂ by bilinear interpolation at the centres of its cells and taken row by row, as
//! gray values in [0, 1] (section III-B). Outside the frame the nearest edge pixel counts.

use super::{GrayFrame, Params, Rect};

/// Cuts patches out of frames; keeps its buffers from one patch to the next.
#[derive(Debug, Clone, Default)]
pub(super) struct PatchCutter {
    columns: Vec<Sample>,
    line: Vec<f32>,
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
        self.columns.clear();
        let columns = params.patch_width;
        self.columns
            .extend((0..columns).map(|i| sample(area.x, area.width, i, columns, width)));
        let from = self.columns[0].first;
        let last = self.columns[columns as usize - 1].first;
        // One more pixel for the second of the last two; at the right edge it is the edge pixel again.
        let until = (last + 2).min(width);
        self.line.resize(last + 2 - from, 0.0);

        let rows = params.patch_height;
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
            if until < last + 2 {
                self.line[until - from] = self.line[until - 1 - from];
            }
            for (value, column) in target.iter_mut().zip(&self.columns) {
                let at = column.first - from;
                let pair = &self.line[at..at + 2];
                let gray = pair[0] + (pair[1] - pair[0]) * column.share;
                *value = f64::from((gray * (1.0 / 255.0)).min(1.0));
            }
        }
    }
}

/// Where the centre of cell `index` of `count` over `[start, start + extent)` lies among `pixels` pixels, whose
/// own centres are at a half.
fn sample(start: f64, extent: f64, index: u32, count: u32, pixels: usize) -> Sample {
    let center = start + extent * (f64::from(index) + 0.5) / f64::from(count) - 0.5;
    let clamped = center.clamp(0.0, (pixels - 1) as f64);
    let first = clamped as usize;
    Sample {
        first,
        share: (clamped - first as f64) as f32,
    }
}

/// The feature vector of `area` of `image`, both in working pixels: D gray values in [0, 1], row by row.
pub fn patch(image: &GrayFrame, area: &Rect, params: &Params) -> Vec<f32> {
    let mut values = vec![0.0; params.feature_len()];
    PatchCutter::default().cut(image, area, params, &mut values);
    values.into_iter().map(|value| value as f32).collect()
}
