//! Histograms of gradient directions: the feature vector of an area, from the sums over its cells.

use pulp::{Arch, Simd, WithSimd};

use crate::tracker::features::centering::Centering;
use crate::tracker::features::hog_cells::Area;
use crate::tracker::features::integral::{DIRECTIONS, GRAY, IntegralChannels};
use crate::tracker::image::rect::Rect;
use crate::tracker::params::table::Params;

/// The weight of the gray value beside the directions: a blurred target has few gradients.
pub(crate) const GRAY_WEIGHT: f32 = 0.3;

/// Values of a cell: the directions, then its gray value.
pub(crate) const CHANNELS: usize = DIRECTIONS + 1;

/// Room for the cells of areas.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hog {
    columns: usize,
    rows: usize,
    /// Of two areas, so that the one is summed up while the other is still divided.
    areas: [Area; 2],
}

/// [`Hog::describe`], to be compiled for the instructions that this machine has.
struct Describe<'a, A> {
    cells: &'a mut Hog,
    sums: &'a IntegralChannels,
    areas: A,
    gray_weight: f32,
    out: &'a mut [f32],
    centering: Option<Centering<'a>>,
}

impl<A: Iterator<Item = Rect>> WithSimd for Describe<'_, A> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            cells,
            sums,
            mut areas,
            gray_weight,
            out,
            mut centering,
        } = self;
        let size = (cells.columns, cells.rows);
        let [now, before] = &mut cells.areas;
        let (mut now, mut before) = (now, before);
        let mut coming = areas.next();
        if let Some(area) = &coming {
            now.locate(sums, area, size);
        }
        let mut vectors = out.chunks_exact_mut(size.0 * size.1 * CHANNELS);
        let (mut last, mut one_before) = (&mut [][..], &mut [][..]);
        // What is read was written one area ago: it has come to the cache meanwhile, which takes longer than to compute it.
        while let Some(area) = coming {
            coming = areas.next();
            if let Some(area) = &coming {
                before.locate(sums, area, size);
            }
            now.sum_up(simd, sums, &area, size.0);
            before.normalize(simd, size.0, gray_weight, last);
            center(simd, &mut centering, one_before);
            (one_before, last) = (last, vectors.next().expect("a vector for each area"));
            (now, before) = (before, now);
        }
        before.normalize(simd, size.0, gray_weight, last);
        center(simd, &mut centering, one_before);
        center(simd, &mut centering, last);
    }
}

/// Centers a vector, if there is one and that is asked for.
#[inline(always)]
fn center<S: Simd>(simd: S, centering: &mut Option<Centering<'_>>, vector: &mut [f32]) {
    if let Some(centering) = centering
        && !vector.is_empty()
    {
        centering.apply(simd, vector);
    }
}

impl Hog {
    /// Writes the feature vectors of `areas` (working pixels, sides above 0, in the window that was summed up) to `out`,
    /// each of length D: cell by cell, row by row, the nine directions and the gray value.
    ///
    /// Each cell's directions are divided by the root of the mean energy of the 3 x 3 cells around it and clipped.
    /// Gray values have the area's mean taken off and are divided by its standard deviation. The vectors are centered, if
    /// that is asked for.
    pub fn describe(
        &mut self,
        sums: &IntegralChannels,
        areas: impl Iterator<Item = Rect>,
        params: &Params,
        out: &mut [f32],
        centering: Option<Centering<'_>>,
    ) {
        self.prepare(params.patch_width as usize, params.patch_height as usize);
        Arch::new().dispatch(Describe {
            cells: self,
            sums,
            areas,
            gray_weight: GRAY_WEIGHT,
            out,
            centering,
        });
    }

    /// The gray values of the cells of an area that was described alone, summed over their pixels.
    pub fn grays(&self) -> impl Iterator<Item = f32> {
        self.areas[0].cells.iter().map(|cell| cell.0[GRAY])
    }

    /// Makes room for up to so many columns and rows of cells, for areas of different numbers of them.
    pub fn reserve(&mut self, columns: usize, rows: usize) {
        if self.areas[0].cells.capacity() < columns * rows {
            self.prepare(columns, rows);
        }
    }

    /// Makes room for so many columns and rows of cells.
    fn prepare(&mut self, columns: usize, rows: usize) {
        if (self.columns, self.rows) == (columns, rows) {
            return;
        }
        (self.columns, self.rows) = (columns, rows);
        for area in &mut self.areas {
            area.prepare(columns, rows);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::features::hog_cells::{FLAT, GREATEST};
    use crate::tracker::image::frame::GrayFrame;
    use crate::tracker::params::presets::Preset;

    fn frame() -> GrayFrame {
        let luma = (0..60 * 50).map(|i| ((i * i / 7 + i) % 251) as u8);
        GrayFrame::from_luma(60, 50, luma.collect()).expect("a frame of this size")
    }

    /// Direction (in bins) and strength of the gradient of the pixel at (`x`, `y`).
    fn gradient(frame: &GrayFrame, x: usize, y: usize) -> (f64, f64) {
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

    /// Sums over a cell by going through its pixels, each with the share of it that is inside.
    fn cell(frame: &GrayFrame, area: &Rect) -> [f64; CHANNELS] {
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
                sums[DIRECTIONS] += share * f64::from(frame.pixels()[y * width + x]);
            }
        }
        sums
    }

    #[test]
    fn cells_are_sums_over_their_pixels() {
        let frame = frame();
        let (mut sums, mut cells) = (IntegralChannels::default(), Hog::default());
        cells.prepare(4, 4);
        for area in [
            Rect::new(10.0, 8.0, 32.0, 24.0),
            Rect::new(3.3, 4.7, 21.9, 17.1),
            Rect::new(-9.5, 35.2, 40.0, 30.0),
        ] {
            sums.compute(&frame, &Rect::new(-20.0, 0.0, 75.0, 80.0), (4.0, 4.0));
            cells.areas[0].locate(&sums, &area, (4, 4));
            cells.areas[0].sum_up(pulp::Scalar, &sums, &area, 4);
            for index in 0..16 {
                let (width, height) = (area.width / 4.0, area.height / 4.0);
                let x = area.x + (index % 4) as f64 * width;
                let y = area.y + (index / 4) as f64 * height;
                let expected = cell(&frame, &Rect::new(x, y, width, height));
                let found = &cells.areas[0].cells[index].0;
                for (found, expected) in found.iter().zip(&expected[..DIRECTIONS]) {
                    assert!(
                        (f64::from(*found) - expected).abs() < 4.0,
                        "{found} {expected}"
                    );
                }
                assert!((f64::from(found[GRAY]) - expected[DIRECTIONS]).abs() < 2.0);
            }
        }
    }

    fn features(frame: &GrayFrame, area: Rect, params: &Params) -> Vec<f32> {
        let mut sums = IntegralChannels::default();
        let (width, height) = (f64::from(frame.width()), f64::from(frame.height()));
        sums.compute(frame, &Rect::new(0.0, 0.0, width, height), (4.0, 4.0));
        let mut out = vec![1.0; params.feature_len()];
        Hog::default().describe(&sums, std::iter::once(area), params, &mut out, None);
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
        let place = |i: usize| {
            Rect::new(
                area.x + (i % 5) as f64 * width,
                area.y + (i / 5) as f64 * height,
                width,
                height,
            )
        };
        let cells: Vec<_> = (0..20).map(|i| cell(&frame, &place(i))).collect();
        let energy =
            |cell: &[f64; CHANNELS]| -> f64 { cell[..DIRECTIONS].iter().map(|v| v * v).sum() };
        let mean = cells.iter().map(|cell| cell[DIRECTIONS]).sum::<f64>() / 20.0;
        let variance = cells
            .iter()
            .map(|cell| (cell[DIRECTIONS] - mean).powi(2))
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
            let floor = (f64::from(FLAT) * width * height).powi(2);
            let divisor = 3.0 * (mean_energy + floor).sqrt();
            for (value, sum) in values.iter().zip(&cells[index][..DIRECTIONS]) {
                let expected = (sum / divisor).min(f64::from(GREATEST));
                assert!(
                    (f64::from(*value) - expected).abs() < 2e-3,
                    "{value} {expected}"
                );
            }
            let gray = (cells[index][DIRECTIONS] - mean) * f64::from(GRAY_WEIGHT) / variance.sqrt();
            assert!((f64::from(values[DIRECTIONS]) - gray).abs() < 2e-3);
        }
    }

    #[test]
    fn features_hardly_change_with_the_light_and_follow_their_area() {
        let params = Preset::Robust.params();
        let bright = frame();
        let dim = bright.pixels().iter().map(|gray| gray / 2 + 10).collect();
        let dim = GrayFrame::from_luma(60, 50, dim).expect("a frame of this size");
        let area = Rect::new(12.0, 9.0, 30.0, 28.0);
        let distance =
            |a: &[f32], b: &[f32]| -> f32 { a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum() };
        let here = features(&bright, area, &params);
        let dimmed = distance(&here, &features(&dim, area, &params));
        let moved = Rect { x: 17.0, ..area };
        let moved = distance(&here, &features(&bright, moved, &params));
        assert!(dimmed * 5.0 < moved, "{dimmed} {moved}");
    }

    #[test]
    fn a_flat_area_has_features_of_zero() {
        let flat = GrayFrame::from_luma(20, 20, vec![90; 400]).expect("a frame of this size");
        let params = Preset::Robust.params();
        let out = features(&flat, Rect::new(4.0, 4.0, 12.0, 12.0), &params);
        assert!(out.iter().all(|value| value.abs() < 1e-3));
    }
}
