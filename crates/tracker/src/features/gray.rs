//! Gray patches (section III-B), the feature vectors of the preset `paper`.
//!
//! An area is resized to H₁ x H₂ by bilinear interpolation at the centres of its cells and taken row by row, as
//! gray values in [0, 1]. Outside the frame the nearest edge pixel counts.

use pulp::{Arch, Simd};

use crate::image::frame::Frame;
use crate::image::rect::Rect;
use crate::params::table::Params;

/// Rows or columns of cells, at most.
const MAX_CELLS: usize = 64;

/// Cuts the patches of many areas out of one frame; keeps its buffer.
#[derive(Debug, Clone, Default)]
pub(crate) struct GrayPatches {
    /// A row of pixels at the height of a row of cells, interpolated between two rows of the frame. To interpolate
    /// along y once for all cells of a row is half of the work.
    between: Vec<f32>,
}

/// Where the centres of cells lie along one axis.
struct Centers {
    /// The pixel at or before each centre.
    pixels: [usize; MAX_CELLS],
    /// The share of the pixel after that one.
    shares: [f32; MAX_CELLS],
}

impl GrayPatches {
    /// Writes the feature vectors of `areas` (working pixels, finite, sides above 0) to `out`, D values for each.
    pub fn cut(
        &mut self,
        image: &Frame,
        areas: impl Iterator<Item = Rect>,
        params: &Params,
        out: &mut [f32],
    ) {
        // Room for any area at once, so that a larger one allocates nothing.
        self.between.resize(image.width() as usize + 1, 0.0);
        for (area, patch) in areas.zip(out.chunks_exact_mut(params.feature_len())) {
            cut(image, &area, params, &mut self.between, patch);
        }
    }
}

/// Writes the feature vector of one area to `patch`, compiled for this machine's instructions.
#[pulp::with_simd(cut = Arch::new())]
#[inline(always)]
fn cut_simd<S: Simd>(
    _: S,
    image: &Frame,
    area: &Rect,
    params: &Params,
    between: &mut [f32],
    patch: &mut [f32],
) {
    let (columns, rows) = (params.patch_width, params.patch_height);
    let across = centers(area.x, area.width, columns, image.width());
    let down = centers(area.y, area.height, rows, image.height());
    let columns = columns as usize;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let (left, right) = (across.pixels[0], across.pixels[columns - 1]);
    // The pixels after the last centre too, where the frame has them.
    let count = (right + 2).min(width) - left;
    let row = |y: usize| &image.pixels()[y.min(height - 1) * width + left..][..count];
    let mut pairs = [[0.0; 2]; MAX_CELLS];
    let centers = down.pixels.iter().zip(&down.shares);
    for (target, (&y, &share)) in patch.chunks_exact_mut(columns).zip(centers) {
        for ((between, &upper), &lower) in between.iter_mut().zip(row(y)).zip(row(y + 1)) {
            *between = interpolate(upper.into(), lower.into(), share) * (1.0 / 255.0);
        }
        between[count] = between[count - 1];
        for (pair, x) in pairs.iter_mut().zip(&across.pixels[..columns]) {
            *pair = [between[x - left], between[x - left + 1]];
        }
        for ((value, &[first, second]), &share) in target.iter_mut().zip(&pairs).zip(&across.shares)
        {
            *value = interpolate(first, second, share).min(1.0);
        }
    }
}

#[inline(always)]
fn interpolate(first: f32, second: f32, share: f32) -> f32 {
    first + (second - first) * share
}

/// The centres of `count` cells over `[start, start + extent)`, among `pixels` pixels whose own centres are at 0.5, 1.5
/// and so on.
#[inline(always)]
fn centers(start: f64, extent: f64, count: u32, pixels: u32) -> Centers {
    let mut centers = Centers {
        pixels: [0; MAX_CELLS],
        shares: [0.0; MAX_CELLS],
    };
    let last = f64::from(pixels - 1);
    for index in 0..count as usize {
        let center = start + extent * (index as f64 + 0.5) / f64::from(count) - 0.5;
        let clamped = center.clamp(0.0, last);
        centers.pixels[index] = clamped as usize;
        centers.shares[index] = clamped.fract() as f32;
    }
    centers
}

/// The feature vector of `area` of `image`, both in working pixels: D gray values in [0, 1], row by row.
pub fn patch(image: &Frame, area: &Rect, params: &Params) -> Vec<f32> {
    let mut values = vec![0.0; params.feature_len()];
    GrayPatches::default().cut(image, std::iter::once(*area), params, &mut values);
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::presets::Preset;

    fn image(width: u32, height: u32) -> Frame {
        let luma = (0..width * height).map(|i| (i * 97 % 256) as u8).collect();
        Frame::from_luma(width, height, luma).expect("a frame of this size")
    }

    /// Bilinear interpolation at one point, pixel by pixel.
    fn at(image: &Frame, x: f64, y: f64) -> f64 {
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

    /// Areas within the image, over its edges, beyond it, small and large.
    fn areas() -> [Rect; 7] {
        [
            Rect::new(5.0, 6.0, 7.0, 5.0),
            Rect::new(5.3, 6.8, 21.7, 3.9),
            Rect::new(-8.0, -3.5, 20.0, 14.0),
            Rect::new(36.0, 25.0, 30.0, 30.0),
            Rect::new(-200.0, 300.0, 10.0, 10.0),
            Rect::new(-1.5, 3.0, 320.0, 33.0),
            Rect::new(-400.0, -400.0, 1000.0, 1200.0),
        ]
    }

    #[test]
    fn every_cell_is_interpolated_at_its_centre() {
        let params = Params {
            patch_width: 7,
            patch_height: 5,
            ..Preset::Paper.params()
        };
        for (width, height) in [(320, 40), (40, 30), (1, 30), (40, 1), (1, 1)] {
            let image = image(width, height);
            for area in areas() {
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
