//! The gradient histogram of an area: its feature vector, from the integral image.
//!
//! A vector has [`CHANNELS`] values for each cell, cell by cell, row by row: nine directions, two
//! of chroma, the gray value.
//! Each cell's directions are divided by three times the root of the mean energy of the 3 x 3 cells around it, and
//! clipped. The gray values have the area's mean subtracted and are divided by its standard deviation.

use pulp::{Arch, Simd};

use crate::features::hog::cells::HogCells;
use crate::features::hog::channels::CHANNELS;
use crate::features::hog::integral::IntegralChannels;
use crate::image::rect::Rect;
use crate::params::table::Params;

/// The cells that an area is divided into.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layout {
    pub columns: usize,
    pub rows: usize,
    /// The weight of a cell's mean chroma.
    pub chroma_weight: f32,
}

impl Layout {
    /// The layout of a candidate's cells.
    pub fn of(params: &Params) -> Self {
        Self {
            columns: params.patch_width as usize,
            rows: params.patch_height as usize,
            chroma_weight: params.chroma_weight as f32,
        }
    }
}

/// Writes the feature vectors of `areas` (pixels of the frame, sides above 0, in the window of `integral`) to `out`:
/// `columns * rows * CHANNELS` values each. Afterwards `cells` has the last area's cells.
#[pulp::with_simd(describe = Arch::new())]
#[inline(always)]
pub(crate) fn describe_simd<S: Simd, A: Iterator<Item = Rect>>(
    simd: S,
    cells: &mut HogCells,
    integral: &IntegralChannels,
    areas: A,
    layout: Layout,
    out: &mut [f32],
) {
    cells.resize(layout.columns, layout.rows);
    let vectors = out.chunks_exact_mut(layout.columns * layout.rows * CHANNELS);
    for (area, vector) in areas.zip(vectors) {
        cells.sum(simd, integral, &area);
        cells.normalize(simd, layout.chroma_weight, vector);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::hog::cells::{MAX_DIRECTION, MIN_STRENGTH};
    use crate::features::hog::channels::{CHROMA, DIRECTIONS, GRAY, GRAY_WEIGHT, HALF_CHROMA};
    use crate::image::frame::Frame;
    use crate::params::presets::Preset;

    fn frame() -> Frame {
        let luma = (0..60 * 50).map(|i| ((i * i / 7 + i) % 251) as u8);
        let chroma = |k| (0..30 * 25).map(move |i| (90 + (i * i / 9 + i * k) % 80) as u8);
        let chroma = Some([chroma(5).collect(), chroma(11).collect()]);
        let frame = Frame::from_reduced((60, 50), (60, 50), luma.collect(), chroma);
        frame.expect("a frame of this size")
    }

    /// Direction (in bins) and strength of the gradient of the pixel at (`x`, `y`).
    fn gradient(frame: &Frame, x: usize, y: usize) -> (f64, f64) {
        let (width, height) = (frame.width() as usize, frame.height() as usize);
        let pixel = |x: usize, y: usize| f64::from(frame.pixels()[y * width + x]);
        let across = pixel((x + 1).min(width - 1), y) - pixel(x.saturating_sub(1), y);
        let down = pixel(x, (y + 1).min(height - 1)) - pixel(x, y.saturating_sub(1));
        let orientation =
            down.atan2(across).rem_euclid(std::f64::consts::PI) / std::f64::consts::PI;
        (
            (orientation * DIRECTIONS as f64).min(8.9999999),
            across.hypot(down),
        )
    }

    /// The sums over a cell, pixel by pixel, each weighted by the share of it that is inside.
    fn cell(frame: &Frame, area: &Rect) -> [f64; CHANNELS] {
        let mut sums = [0.0; CHANNELS];
        let width = frame.width() as usize;
        for y in 0..frame.height() as usize {
            for x in 0..width {
                let (bin, strength) = gradient(frame, x, y);
                let pixel = Rect::new(x as f64, y as f64, 1.0, 1.0);
                let across = (area.x + area.width).min(pixel.x + 1.0) - area.x.max(pixel.x);
                let down = (area.y + area.height).min(pixel.y + 1.0) - area.y.max(pixel.y);
                let share = across.max(0.0) * down.max(0.0);
                let (lower, part) = (bin as usize, bin.fract());
                sums[lower] += share * strength * (1.0 - part);
                sums[(lower + 1) % DIRECTIONS] += share * strength * part;
                sums[GRAY] += share * f64::from(frame.pixels()[y * width + x]);
                let planes = frame.chroma.as_ref().expect("it has colour");
                for (channel, plane) in CHROMA.into_iter().zip(planes) {
                    let chroma = f64::from(plane.pixels[y / 2 * 30 + x / 2]) - 128.0;
                    sums[channel] += share * chroma / (f64::from(HALF_CHROMA) + chroma.abs());
                }
            }
        }
        sums
    }

    #[test]
    fn cells_are_sums_over_their_pixels() {
        let frame = frame();
        let (mut integral, mut cells) = (IntegralChannels::default(), HogCells::default());
        cells.resize(4, 4);
        for area in [
            Rect::new(10.0, 8.0, 32.0, 24.0),
            Rect::new(3.3, 4.7, 21.9, 17.1),
            Rect::new(-9.5, 35.2, 40.0, 30.0),
        ] {
            integral.compute(&frame, &Rect::new(-20.0, 0.0, 75.0, 80.0), (4.0, 4.0));
            cells.sum(pulp::Scalar, &integral, &area);
            for index in 0..16 {
                let (width, height) = (area.width / 4.0, area.height / 4.0);
                let x = area.x + (index % 4) as f64 * width;
                let y = area.y + (index / 4) as f64 * height;
                let expected = cell(&frame, &Rect::new(x, y, width, height));
                let found = &cells.cells[index].0;
                for (found, expected) in found.iter().zip(&expected[..DIRECTIONS]) {
                    assert!(
                        (f64::from(*found) - expected).abs() < 4.0,
                        "{found} {expected}"
                    );
                }
                let expected = expected[GRAY] - f64::from(integral.mean_gray) * width * height;
                assert!((f64::from(found[GRAY]) - expected).abs() < 1.0);
            }
        }
    }

    fn features(frame: &Frame, area: Rect, params: &Params) -> Vec<f32> {
        let mut integral = IntegralChannels::default();
        let (width, height) = (f64::from(frame.width()), f64::from(frame.height()));
        integral.compute(frame, &Rect::new(0.0, 0.0, width, height), (4.0, 4.0));
        let mut out = vec![1.0; params.feature_len()];
        let (areas, layout) = (std::iter::once(area), Layout::of(params));
        describe(&mut HogCells::default(), &integral, areas, layout, &mut out);
        out
    }

    #[test]
    fn features_are_normalised_by_the_cells_around() {
        let params = Params {
            patch_width: 5,
            patch_height: 4,
            ..Preset::Robust.params()
        };
        let frame = frame();
        let area = Rect::new(9.2, 6.1, 35.0, 30.0);
        let found = features(&frame, area, &params);
        let (width, height) = (area.width / 5.0, area.height / 4.0);
        let cell_area = |i: usize| {
            Rect::new(
                area.x + (i % 5) as f64 * width,
                area.y + (i / 5) as f64 * height,
                width,
                height,
            )
        };
        let cells: Vec<_> = (0..20).map(|i| cell(&frame, &cell_area(i))).collect();
        let energy =
            |cell: &[f64; CHANNELS]| -> f64 { cell[..DIRECTIONS].iter().map(|v| v * v).sum() };
        let mean = cells.iter().map(|cell| cell[GRAY]).sum::<f64>() / 20.0;
        let variance = cells
            .iter()
            .map(|cell| (cell[GRAY] - mean).powi(2))
            .sum::<f64>()
            / 20.0;
        for (index, values) in found.chunks_exact(CHANNELS).enumerate() {
            let (i, j) = (index % 5, index / 5);
            let beside = |at: usize| (at % 5).abs_diff(i) <= 1 && (at / 5).abs_diff(j) <= 1;
            let around: Vec<f64> = (0..20)
                .filter(|&at| beside(at))
                .map(|at| energy(&cells[at]))
                .collect();
            let mean_energy = around.iter().sum::<f64>() / around.len() as f64;
            let floor = (f64::from(MIN_STRENGTH) * width * height).powi(2);
            let divisor = 3.0 * (mean_energy + floor).sqrt();
            for (value, sum) in values.iter().zip(&cells[index][..DIRECTIONS]) {
                let expected = (sum / divisor).min(f64::from(MAX_DIRECTION));
                assert!(
                    (f64::from(*value) - expected).abs() < 2e-3,
                    "{value} {expected}"
                );
            }
            let gray = (cells[index][GRAY] - mean) * f64::from(GRAY_WEIGHT) / variance.sqrt();
            assert!((f64::from(values[GRAY]) - gray).abs() < 2e-3);
            for channel in CHROMA {
                let expected = cells[index][channel] * params.chroma_weight / (width * height);
                let found = f64::from(values[channel]);
                assert!((found - expected).abs() < 2e-3, "{found} {expected}");
            }
        }
    }

    #[test]
    fn features_hardly_change_with_the_light_and_follow_their_area() {
        let params = Preset::Robust.params();
        let bright = frame();
        let dim = bright.pixels().iter().map(|gray| gray / 2 + 10).collect();
        let dim = Frame::from_luma(60, 50, dim).expect("a frame of this size");
        let area = Rect::new(12.0, 9.0, 30.0, 28.0);
        let distance =
            |a: &[f32], b: &[f32]| -> f32 { a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum() };
        let here = features(&bright, area, &params);
        let dimmed = distance(&here, &features(&dim, area, &params));
        let moved = Rect { x: 17.0, ..area };
        let moved = distance(&here, &features(&bright, moved, &params));
        assert!(dimmed * 5.0 < moved, "{dimmed} {moved}");
    }

    /// Sums over a bright frame pass 2^24, beyond which single precision does not hold every whole number.
    #[test]
    fn features_in_the_last_corner_of_a_bright_frame_are_those_of_the_same_pixels_alone() {
        let gray = |x: usize, y: usize| (243 + (x * x / 7 + y * 5 + x * y) % 13) as u8;
        let pixels = (0..320 * 240).map(|i| gray(i % 320, i / 320)).collect();
        let frame = Frame::from_luma(320, 240, pixels).expect("a frame of this size");
        let pixels = (0..48 * 40)
            .map(|i| gray(272 + i % 48, 200 + i / 48))
            .collect();
        let corner = Frame::from_luma(48, 40, pixels).expect("a frame of this size");
        let params = Preset::Robust.params();
        for (x, y) in [(4.0, 3.0), (6.3, 2.6), (11.8, 3.1)] {
            let alone = features(&corner, Rect::new(x, y, 32.0, 32.0), &params);
            let area = Rect::new(272.0 + x, 200.0 + y, 32.0, 32.0);
            for (found, expected) in features(&frame, area, &params).iter().zip(alone) {
                assert!((found - expected).abs() < 5e-4, "{found} {expected}");
            }
        }
    }

    #[test]
    fn a_flat_area_has_features_of_zero() {
        let flat = Frame::from_luma(20, 20, vec![90; 400]).expect("a frame of this size");
        let params = Preset::Robust.params();
        let out = features(&flat, Rect::new(4.0, 4.0, 12.0, 12.0), &params);
        assert!(out.iter().all(|value| value.abs() < 1e-3));
    }
}
